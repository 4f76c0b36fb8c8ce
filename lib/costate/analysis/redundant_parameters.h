// Parameters that redundant constraints do not let move: of three parallel links that carry a plate one alone cannot
// become longer. Derivatives by such a parameter do not exist; by least squares each formulation would print one.
#pragma once

#include "costate/assembly/assembly.h"

namespace costate {

/// At the start of the assembly's parameters at time t. Throws ModelError naming the parameter and the row that would
/// be torn most.
void require_compatible_parameters(Assembly& assembly, double t);

}  // namespace costate
