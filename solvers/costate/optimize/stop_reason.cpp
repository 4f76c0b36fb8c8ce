#include "costate/optimize/stop_reason.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace costate {

namespace {

/// Of what psi is, or has fallen by: what the last trials of a converged search may lie above its best point.
constexpr double kElsewhere = 1e-3;

}  // namespace

std::string low_enough(const OptimizerOptions& options) {
  return fmt::format("stop value: psi fell to {:g} or below", *options.stop_value);
}

std::string reason_of(nlopt::result result, const OptimizerOptions& options) {
  switch (result) {
    case nlopt::STOPVAL_REACHED:
      return low_enough(options);
    case nlopt::FTOL_REACHED:
      return fmt::format("relative tolerance: psi changed by less than {:g} of itself", options.relative_tolerance);
    case nlopt::XTOL_REACHED:
      return "parameter tolerance: the step became negligible";
    default:
      return {};
  }
}

bool ended_elsewhere(const std::vector<OptimizerEvaluation>& evaluations, std::size_t best) {
  const OptimizerEvaluation& last = evaluations.back();
  if (last.failed()) return false;
  const double least = evaluations[best].psi;
  return last.psi - least > kElsewhere * std::max(std::abs(least), evaluations.front().psi - least);
}

}  // namespace costate
