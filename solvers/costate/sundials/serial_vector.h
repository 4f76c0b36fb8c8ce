// SUNDIALS' serial vectors, made lighter for systems of ten to some hundred unknowns, where its own spend more time on
// allocation and dispatch than on arithmetic: one allocation for head, content and data, one table of operations for
// all vectors, fused operations on, short loops.
#pragma once

#include <nvector/nvector_serial.h>

namespace costate {

/// A zero vector. It is a serial vector in every respect (NV_DATA_S, N_VGetVectorID, dense solvers); its clones are
/// made the same way, and N_VDestroy frees it. Null when memory runs out.
N_Vector new_serial_vector(sunindextype size, SUNContext context);

/// What a vector takes beside its numbers, the allocator's share included.
inline constexpr int kVectorHeadBytes = 64;

}  // namespace costate
