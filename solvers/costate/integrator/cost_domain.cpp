#include "costate/integrator/cost_domain.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/unsaid.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/sampled_cost.h"

namespace costate {

namespace {

constexpr int kSamples = 1000;
/// A run that failed for another reason is not repeated to its end.
constexpr long kMostSteps = 50000;

bool is_finite(const ScalarGradient& g) {
  return g.q.allFinite() && g.v.allFinite() && g.a.allFinite() && g.lambda.allFinite() && g.z.allFinite() &&
         g.rho.allFinite();
}

std::string name_of(const CostTerm& term, const char* kind, std::size_t index) {
  if (const auto* of = dynamic_cast<const OutputTerm*>(&ungated(term)))
    return fmt::format("the {} cost of '{}'", kind, of->output().name());
  return fmt::format("term {} of the {} cost", index + 1, kind);
}

/// What is wrong with a sum of terms at a state.
std::string wrong_at(const std::vector<std::shared_ptr<const CostTerm>>& terms, const char* kind, const StateView& s,
                     Assembly& assembly) {
  ScalarGradient g;
  g.resize(assembly);
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const double value = terms[i]->value(s, assembly);
    if (!std::isfinite(value))
      return fmt::format("{} is {} at t = {:.6g} s first", name_of(*terms[i], kind, i), std::abs(value), s.t);
    g.set_zero();
    terms[i]->add_gradient(s, assembly, 1, g);
    if (!is_finite(g))
      return fmt::format("the derivative of {} is not finite at t = {:.6g} s first", name_of(*terms[i], kind, i), s.t);
  }
  return {};
}

}  // namespace

std::string cost_not_finite(const Problem& problem, const std::vector<double>& rho) {
  const Objective& cost = problem.objective;
  if (cost.running.empty() && (cost.terminal.empty() || has_samples(cost))) return {};
  Problem without = problem;
  without.objective = {};
  without.solver.max_steps = std::min(problem.solver.max_steps, kMostSteps);
  const double begin = problem.solver.t_start, end = problem.solver.t_end;
  std::vector<double> times;
  for (int i = 0; i <= kSamples; ++i) times.push_back(i < kSamples ? begin + (end - begin) * i / kSamples : end);
  std::string found;
  struct Found {};
  try {
    const Unsaid search;
    simulate(without, rho, times, [&](const MechanismState& s, System& system) {
      found = wrong_at(cost.running, "running", s, system.assembly());
      if (found.empty() && s.t == end && !has_samples(cost))
        found = wrong_at(cost.terminal, "terminal", s, system.assembly());
      if (!found.empty()) throw Found();
    });
  } catch (const Found&) {
  } catch (const SolverError&) {  // the motion ends by itself
  } catch (const CapabilityError&) {
  }
  if (found.empty()) return {};
  return fmt::format(
      "The cost is not finite along this motion: {} (of {} samples): a formula outside its domain (the root of "
      "something negative, a division by zero), or numbers that overflow.",
      found, kSamples + 1);
}

}  // namespace costate
