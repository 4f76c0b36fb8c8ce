// Gradients hold the times fixed at which the law of a driver has a kink or a jump of its curvature: where a parameter moves
// such a time, the derivatives under the integral miss what the moved jump does. These throw CapabilityError then, with the
// parameter, the element and the time.
#pragma once

#include "costate/assembly/assembly.h"

namespace costate {

/// For the kink at time t.
void require_fixed_kink(const Assembly& assembly, double t);

/// For every jump of a driver's acceleration within t_start < t < t_end.
void require_fixed_accelerations(const Assembly& assembly, double t_start, double t_end);

}  // namespace costate
