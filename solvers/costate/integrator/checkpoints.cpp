#include "costate/integrator/checkpoints.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/sundials/serial_vector.h"

namespace costate {

namespace {
// The backward run interpolates between order + 1 stored points, up to 13 with Adams' method; SUNDIALS does not look
// whether a segment has as many and reads past the end of its arrays.
constexpr long kFewestSteps = 16;

double bytes_of_a_step(int unknowns) {
  constexpr double bytes_beside_vectors = 64;  // SUNDIALS' own record of a step
  return 2 * (8.0 * unknowns + kVectorHeadBytes) + bytes_beside_vectors;
}

double steps_that_fit(const SolverOptions& options, int unknowns) {
  return std::max(static_cast<double>(kFewestSteps), options.memory_budget_MB * 1e6 / bytes_of_a_step(unknowns));
}

/// Room for all steps between two checkpoints is taken before the first of them.
void require_room(long steps, int unknowns) {
  constexpr double most_MB = 4096;
  const double MB = static_cast<double>(steps) * bytes_of_a_step(unknowns) / 1e6;
  if (MB > most_MB)
    throw Error(fmt::format(
        "{} steps between checkpoints of {} unknowns need {:.0f} MB, {:.0f} are the limit. Choose fewer: the "
        "gradient does not depend on their number.",
        steps, unknowns, MB, most_MB));
}
}  // namespace

CheckpointPlan plan_checkpoints(const SolverOptions& options, int unknowns) {
  if (options.checkpoint_steps > 0) {
    require_room(options.checkpoint_steps, unknowns);
    return {std::max(kFewestSteps, options.checkpoint_steps), true};
  }
  const double fit = steps_that_fit(options, unknowns);
  // Variable-order methods of order up to 5 take about (1/rtol)^(1/6) steps per unit of smoothness.
  const double expected = 1000 * std::max(1.0, std::pow(1e-6 / options.rtol, 1.0 / 6));
  return {static_cast<long>(std::min(fit, expected)), fit <= expected};
}

CheckpointPlan plan_again(const SolverOptions& options, int unknowns, long steps) {
  const double fit = steps_that_fit(options, unknowns);
  const double wanted = 1.25 * static_cast<double>(steps) + 100;  // steps vary a little with the checkpoints
  return {static_cast<long>(std::min(fit, wanted)), fit <= wanted};
}

std::size_t segments_that_fit(const SolverOptions& options, int unknowns, const CheckpointPlan& plan) {
  constexpr double bytes_of_a_session = 2e5;  // the integrator's own, and its matrices', of a small system
  const double bytes = bytes_of_a_session + static_cast<double>(plan.steps) * bytes_of_a_step(unknowns);
  return static_cast<std::size_t>(std::max(2.0, options.memory_budget_MB * 1e6 / bytes));
}

void RepeatWatch::forward(long steps) {
  if (!plan_.repeats) return;
  if (backward_) {
    backward_ = false;
    repeating_ = true;
    first_ = steps;
  }
  if (repeating_ && steps - first_ >= plan_.steps)
    throw SolverError(
        fmt::format("The forward run could not be repeated from a checkpoint: it took more than the {} "
                    "steps of the original. Raise the memory budget, or the number of steps between "
                    "checkpoints.",
                    plan_.steps));
  // All evaluations of a segment's first step: the original makes some that its repetition does not (to choose the size
  // of the very first step).
  if (steps % plan_.steps == 0) system_.forget_history();
}

}  // namespace costate
