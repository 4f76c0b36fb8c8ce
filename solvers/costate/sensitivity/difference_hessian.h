// The Hessian of psi where nobody offers its products (motions with events, costs on cycles): differences of the exact
// gradient along each parameter, extrapolated, with what they leave open. Whoever takes it says so.
#pragma once

#include <string>
#include <vector>

#include "costate/sensitivity/hessian.h"

namespace costate {

/// By gradients of `method` at distances of 4e-3 of each parameter's scale and less, within its bounds: four for each.
/// `asymmetry`, and `error` with it, also holds what the last extrapolation changed. Throws what gradients throw.
Hessian hessian_by_differences(const Problem& problem, const std::string& method, const std::vector<double>& rho);

}  // namespace costate
