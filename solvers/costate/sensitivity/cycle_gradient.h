// psi over a cycle as the scene's own psi, with its gradient by any method while the cycle follows the parameters
// (lib/README.md (18.6)).
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

/// psi over the cycle of problem.cycle, and its events.
Simulation cycle_run(const Problem& problem, const std::vector<double>& rho);

/// The search for the cycle, with l of (I - P_x)^T l = psi_x^T, then psi_rho + l^T P_rho by one run of the method with
/// l^T P in its terminal cost; forward methods take both from the last run of the search.
GradientResult cycle_gradient(const Problem& problem, const std::string& method, const std::vector<double>& rho);

/// The motion to show of a problem, and its parameters' values: where psi lives on a cycle, the one that begins there
/// and goes on until the problem's own end, without a cost, whose first parameters are the given one's; else what is
/// given.
std::pair<Problem, std::vector<double>> shown_motion(const Problem& problem, const std::vector<double>& rho);

}  // namespace costate
