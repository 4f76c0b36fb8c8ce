// Where an event ends a run on soft constraints, of what rows hold but for as much as they give: when it comes is told
// by a run with exact constraints. (Firmer ones do not tell: their rows settle in the same time, and an acceleration
// that is zero but for that passes zero when it does before, whatever the weight.)
#pragma once

#include <vector>

#include "costate/problem/problem.h"

namespace costate {

/// Of a run by a penalty that an event has ended, with a gradient or without: widens the known error of psi, and that
/// of the gradient by as much of it as the end moves by, gives notice where the end is another one with exact
/// constraints, and throws NoEndError where it does not come with those. Nothing of other runs.
void watch_soft_end(const Problem& problem, const std::vector<double>& rho, GradientResult& result);

}  // namespace costate
