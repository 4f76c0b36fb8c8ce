// optimize() on what the runs of a design are, and what its result says of itself.
#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/integrator/fixed_run.h"
#include "costate/optimize/bound_size.h"
#include "costate/optimize/optimizer_run.h"
#include "costate/sensitivity/method.h"

namespace costate {

std::optional<std::size_t> best_evaluation(const std::vector<OptimizerEvaluation>& evaluations, std::size_t count,
                                           const Design& design) {
  std::optional<std::size_t> best;
  const std::vector<DesignBound> bounds = design.bounds();
  std::vector<double> sizes;
  double tightest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < count; ++i)
    if (!evaluations[i].failed()) tightest = std::min(tightest, evaluations[i].rtol);
  double least = std::numeric_limits<double>::infinity(), least_violation = least;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& e = evaluations[i];
    if (e.failed() || e.rtol > tightest) continue;
    if (sizes.empty()) sizes = bound_sizes(design.parameters, e, bounds);
    double violation = 0;
    for (std::size_t c = 0; c < e.constraints.size(); ++c)
      violation =
          std::max(violation, (e.constraints[c] - kept_within(sizes[c], bounds[c].upper, design.rtol())) / sizes[c]);
    if (violation < least_violation || (violation == least_violation && e.psi < least)) {
      least_violation = violation;
      least = e.psi;
      best = i;
    }
  }
  return best;
}

std::string message_of(const std::exception_ptr& error) {
  try {
    std::rethrow_exception(error);
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {
    return "unknown";
  }
}

std::size_t OptimizerResult::failures() const {
  return static_cast<std::size_t>(
      std::count_if(evaluations.begin(), evaluations.end(), [](const auto& e) { return e.failed(); }));
}

std::string cannot_adapt(const Design& design) {
  if (design.several()) return "The tolerance of an optimization over several cases cannot adapt.";
  if (!design.bounds().empty()) return "The tolerance of an optimization with constraints cannot adapt.";
  const DesignCase& c = design.cases.front();
  if (by_fixed_steps(c.problem, find_sensitivity_method(c.method)))
    return "Fixed steps follow no tolerance that could adapt.";
  return {};
}

OptimizerResult optimize(const Design& design, const OptimizerOptions& options,
                         const std::vector<OptimizerEvaluation>& replay,
                         const std::function<void(const OptimizerEvaluation&)>& record) {
  // Fixed steps are chosen once: psi and the constraints of all evaluations are those of one discretization.
  Design stepped = design;
  for (DesignCase& c : stepped.cases)
    if (by_fixed_steps(c.problem, find_sensitivity_method(c.method))) c.problem = with_fixed_step(c.problem);
  if (const std::string why = cannot_adapt(design); options.adapt_accuracy && !why.empty()) throw CapabilityError(why);
  return run_optimizer(stepped, options, replay, record);
}

OptimizerResult optimize(const Problem& problem, const std::string& method,
                         const std::vector<OptimizerConstraint>& constraints, const OptimizerOptions& options,
                         const std::vector<OptimizerEvaluation>& replay,
                         const std::function<void(const OptimizerEvaluation&)>& record) {
  return optimize(single_design(problem, method, constraints), options, replay, record);
}

}  // namespace costate
