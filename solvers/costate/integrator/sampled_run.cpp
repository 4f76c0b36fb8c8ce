#include "costate/integrator/sampled_run.h"

#include <fmt/format.h>

namespace costate {

Problem with_separate_samples(const Problem& problem) {
  if (!has_samples(problem.objective) || sample_term(problem.objective)) return problem;
  if (problem.ends_when || problem.cycle)
    throw CapabilityError(
        "Samples ([[cost.samples]]) belong to runs from t_start_s to t_end_s: with 'ends_when' or [run] cycle they are "
        "not taken.");
  const double t_start = problem.solver.t_start, t_end = problem.solver.t_end;
  for (const auto& term : problem.objective.terminal) {
    const auto* cost = dynamic_cast<const SampledCost*>(term.get());
    if (!cost) continue;
    const SampleData& data = cost->data();
    for (const double t : data.times)
      if ((t < t_start && !is_same_time(t, t_start)) || (t > t_end && !is_same_time(t, t_end)))
        throw CapabilityError(
            fmt::format("{} has a sample at t = {:.9g} s, outside the run from {:.9g} to {:.9g} s: "
                        "lengthen the run, or leave samples out by from_s and to_s.",
                        data.path, t, t_start, t_end));
  }
  Problem p = problem;
  p.objective = separate_samples(problem.objective, t_start, t_end);
  return p;
}

}  // namespace costate
