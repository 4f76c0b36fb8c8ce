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

std::string conditions_hold(const OptimizerEvaluation& best, bool constrained) {
  return constrained
             ? "optimality: the optimizer's conditions of first order hold"
             : fmt::format("optimality: to first order nothing is left to gain, the projected gradient is {:.3g}",
                           best.projected_gradient);
}

std::string no_step_evaluated(const OptimizerEvaluation& last) {
  return fmt::format("failed evaluations: no step from the best point led to one that could be evaluated; the last: {}",
                     last.failure);
}

bool ended_elsewhere(const std::vector<OptimizerEvaluation>& evaluations, std::size_t best) {
  const OptimizerEvaluation& last = evaluations.back();
  if (last.failed()) return false;
  const double least = evaluations[best].psi;
  return last.psi - least > kElsewhere * std::max(std::abs(least), evaluations.front().psi - least);
}

}  // namespace costate
