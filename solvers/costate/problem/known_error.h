// What a result is known to be off by: whoever finds an error, or says one in a notice, widens what is known, so that
// no more digits are shown than are told of.
#pragma once

#include "costate/problem/problem.h"

namespace costate {

/// psi may be off by that much.
void widen_error(Simulation& result, double psi);
/// And the gradient: by `scaled` over each parameter's scale, or by these amounts.
void widen_error(GradientResult& result, const ParameterSelection& parameters, double psi, double scaled);
void widen_error(GradientResult& result, double psi, const std::vector<double>& gradient);

}  // namespace costate
