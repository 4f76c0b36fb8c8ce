// Where an event ends a run on soft constraints, of what rows hold but for as much as they give: when it comes is told
// by a run with exact constraints. (Firmer ones do not tell: their rows settle in the same time, and an acceleration
// that is zero but for that passes zero when it does before, whatever the weight.)
#pragma once

#include <vector>

#include "costate/problem/problem.h"

namespace costate {

/// Of a run by a penalty that an event has ended: widens the known error of psi, gives notice where the end is another
/// one with exact constraints, and throws SolverError where it does not come with those. Nothing of other runs.
void watch_soft_end(const Problem& problem, const std::vector<double>& rho, Simulation& result);
/// The same, and widens the known errors of a gradient by as much of it as the end moves by.
void watch_soft_end(const Problem& problem, const std::vector<double>& rho, GradientResult& result);

}  // namespace costate
