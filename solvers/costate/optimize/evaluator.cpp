#include "costate/optimize/evaluator.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/record/interrupt.h"
#include "costate/sensitivity/method.h"

namespace costate {

void Evaluator::compute(OptimizerEvaluation& e, const std::vector<OptimizerEvaluation>& before) {
  const auto begin = std::chrono::steady_clock::now();
  try {
    evaluate(e, before);
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& failure) {
    std::string where;
    for (std::size_t j = 0; j < e.rho.size(); ++j)
      where += fmt::format("{}{} = {:.9g}", j ? ", " : "", problem_.parameters.parameters[j].name, e.rho[j]);
    if (e.index == 1) {
      // Nothing to go back to. What the mechanism objects to keeps its type, and so its place in the scene.
      if (dynamic_cast<const SolverError*>(&failure))
        throw SolverError(fmt::format("Evaluation {} at {}: {}", e.index, where, failure.what()));
      throw;
    }
    OptimizerEvaluation failed;
    failed.index = e.index;
    failed.rho = e.rho;
    failed.psi = failed.projected_gradient = std::numeric_limits<double>::quiet_NaN();
    failed.failure = failure.what();
    if (step_limit_ > 0 && failed.failure.find(fmt::format("after {} steps", step_limit_)) != std::string::npos)
      failed.failure +=
          fmt::format(" The limit is {:g} times the steps of the evaluations before (--step-limit-factor).",
                      options_.step_limit_factor);
    e = std::move(failed);
  }
  e.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void Evaluator::evaluate(OptimizerEvaluation& e, const std::vector<OptimizerEvaluation>& before) {
  Problem problem = problem_;
  if (e.rtol > 0) {
    problem.solver.atol = problem_.solver.absolute() * e.rtol / problem_.solver.rtol;
    problem.solver.rtol = e.rtol;
  }
  limit_steps(problem.solver, before);
  problem.solver.confirm = false;  // step by step; of the optimum the certificate asks more
  const GradientResult r = gradient(problem, method_, e.rho);
  require_finite(r, "psi");
  e.psi = r.psi;
  e.gradient = r.gradient;
  e.counters = r.counters;
  for (const auto& c : constraints_) {
    problem.objective = c.objective;
    const GradientResult rc = gradient(problem, method_, e.rho);
    require_finite(rc, fmt::format("the constraint '{}'", c.name));
    e.constraints.push_back(rc.psi - c.upper);
    e.constraint_gradients.push_back(rc.gradient);
  }
  for (std::size_t j = 0; j < e.rho.size(); ++j) {
    const Parameter& p = problem_.parameters.parameters[j];
    const double x = e.rho[j] / p.scale, g = e.gradient[j] * p.scale;
    const double moved = std::clamp(x - g, p.lower / p.scale, p.upper / p.scale);
    e.projected_gradient = std::max(e.projected_gradient, std::abs(moved - x));
  }
}

void Evaluator::limit_steps(SolverOptions& solver, const std::vector<OptimizerEvaluation>& before) {
  step_limit_ = 0;
  long most = 0;
  for (const auto& e : before)
    if (!e.failed()) most = std::max({most, e.counters.steps, e.counters.backward_steps});
  if (most == 0 || options_.step_limit_factor <= 0) return;
  const double limit = std::max(static_cast<double>(OptimizerOptions::kStepsAlwaysAllowed),
                                options_.step_limit_factor * static_cast<double>(most));
  if (limit < static_cast<double>(solver.max_steps)) solver.max_steps = step_limit_ = static_cast<long>(limit);
}

void Evaluator::require_finite(const GradientResult& r, const std::string& what) const {
  if (!std::isfinite(r.psi)) throw SolverError(fmt::format("{} is {}, not a finite number.", what, r.psi));
  for (std::size_t j = 0; j < r.gradient.size(); ++j)
    if (!std::isfinite(r.gradient[j]))
      throw SolverError(fmt::format("The derivative of {} with respect to {} is {}, not a finite number.", what,
                                    problem_.parameters.parameters[j].name, r.gradient[j]));
}

}  // namespace costate
