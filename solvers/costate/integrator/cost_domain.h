// Whether a cost is finite along the motion. One that is not ends a run as if the mechanism could not move on: adjoints
// and quadratures find no step. What ended it is then looked for in a run without costs.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "costate/base/error.h"
#include "costate/problem/problem.h"

namespace costate {

/// Which term of the cost is no finite number, or has a derivative that is none, and when first; empty where all are,
/// as far as the motion goes.
std::string cost_not_finite(const Problem& problem, const std::vector<double>& rho);

/// What run() returns, with its psi. Where it fails, or psi is no number, throws SolverError that names the cost's
/// term, if that is the cause.
template <class Run>
auto with_cost_told(const Problem& problem, const std::vector<double>& rho, const Run& run) {
  std::string what;
  try {
    auto result = run();
    if (std::isfinite(result.psi)) return result;
    what = cost_not_finite(problem, rho);
    if (what.empty()) return result;
  } catch (const SolverError&) {
    what = cost_not_finite(problem, rho);
    if (what.empty()) throw;
  }
  throw SolverError(what);
}

}  // namespace costate
