#include "costate/sensitivity/error_estimate.h"

#include <algorithm>
#include <cmath>

#include "costate/integrator/simulate.h"
#include "costate/level/penalty_weight.h"
#include "costate/sensitivity/method.h"

namespace costate {

namespace {

/// The same problem solved better, and what part of the error the difference is. Halving the step of a second-order
/// scheme takes away three quarters of it.
Problem better(const Problem& problem, const GradientResult& result, bool fixed) {
  Problem p = problem;
  p.solver.confirm = false;
  if (fixed) {
    p.solver.step_s =
        (problem.solver.t_end - problem.solver.t_start) / (2.0 * static_cast<double>(result.counters.steps));
    return p;
  }
  p.solver.rtol = std::max(problem.solver.rtol / 10, 1e-14);
  p.solver.atol = std::max(problem.solver.absolute() / 10, 1e-16);
  return p;
}

ErrorEstimate apart(const GradientResult& result, const GradientResult& other, bool fixed) {
  const double factor = fixed ? 4.0 / 3.0 : 1.0;
  ErrorEstimate e;
  e.psi = factor * std::abs(result.psi - other.psi);
  if (other.gradient.empty()) return e;  // a run without its gradient
  for (std::size_t j = 0; j < result.gradient.size(); ++j)
    e.gradient.push_back(factor * std::abs(result.gradient[j] - other.gradient[j]));
  return e;
}

/// What the soft constraints of the penalties add is of first order in 1/alpha: a weight ten times as large takes nine
/// tenths of it away. `run` is the same run of another problem.
template <class Run>
void add_softness(const Problem& problem, const GradientResult& result, ErrorEstimate& e, const Run& run) {
  if (!has_soft_constraints(problem.formulation)) return;
  const ErrorEstimate softness = apart(result, run(with_firmer_constraints(problem)), false);
  e.psi += softness.psi / 0.9;
  for (std::size_t j = 0; j < e.gradient.size(); ++j) e.gradient[j] += softness.gradient[j] / 0.9;
}

}  // namespace

bool has_soft_constraints(const std::string& formulation) {
  return formulation == "penalty" || formulation == "penalty-second-order";
}

Problem with_firmer_constraints(const Problem& problem) {
  Problem firmer = problem;
  firmer.solver.confirm = false;
  double& alpha = firmer.formulation_options.penalty_alpha;
  alpha = 10 * (alpha > 0 ? alpha : default_penalty_weight(problem.mechanism));
  return firmer;
}

ErrorEstimate estimate_error(const Problem& problem, const std::vector<double>& rho, const GradientResult& result) {
  const bool fixed = integrator_of(problem) == "fixed";
  const auto run = [&](const Problem& p) { return simulate(p, rho); };
  ErrorEstimate e = apart(result, run(better(problem, result, fixed)), fixed);
  add_softness(problem, result, e, run);
  return e;
}

ErrorEstimate estimate_error(const Problem& problem, const std::string& method, const std::vector<double>& rho,
                             const GradientResult& result) {
  const bool fixed = find_sensitivity_method(method).needs == SensitivityMethod::Needs::discrete;
  const auto run = [&](const Problem& p) { return gradient(p, method, rho); };
  ErrorEstimate e = apart(result, run(better(problem, result, fixed)), fixed);
  add_softness(problem, result, e, run);
  return e;
}

}  // namespace costate
