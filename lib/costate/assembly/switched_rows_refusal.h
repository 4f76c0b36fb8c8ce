// Formulations whose unknowns are counted by their constraints, once and for all.
#pragma once

#include "costate/assembly/assembly.h"

namespace costate {

/// Throws CapabilityError where rows come and go.
void refuse_switched_rows(const Assembly& assembly);
/// Throws CapabilityError where contacts may slide in space: `who` does not carry that, "this formulation", and what
/// does.
void refuse_spatial_friction(const Assembly& assembly, const std::string& who, const std::string& advice);

}  // namespace costate
