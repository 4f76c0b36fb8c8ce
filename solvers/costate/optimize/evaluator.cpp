#include "costate/optimize/evaluator.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/record/interrupt.h"
#include "costate/record/jobs.h"
#include "costate/sensitivity/confirmation.h"
#include "costate/sensitivity/method.h"

namespace costate {

namespace {

void require_finite(const Problem& problem, const GradientResult& r, const std::string& what) {
  if (!std::isfinite(r.psi)) throw SolverError(fmt::format("{} is {}, not a finite number.", what, r.psi));
  for (std::size_t j = 0; j < r.gradient.size(); ++j)
    if (!std::isfinite(r.gradient[j]))
      throw SolverError(fmt::format("The derivative of {} with respect to {} is {}, not a finite number.", what,
                                    problem.parameters.parameters[j].name, r.gradient[j]));
}

}  // namespace

void Evaluator::compute(OptimizerEvaluation& e, const std::vector<OptimizerEvaluation>& before) {
  const auto begin = std::chrono::steady_clock::now();
  const OwnNotices said;
  try {
    evaluate(e, before);
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& failure) {
    std::string where;
    for (std::size_t j = 0; j < e.rho.size(); ++j)
      where += fmt::format("{}{} = {:.9g}", j ? ", " : "", design_.parameters.parameters[j].name, e.rho[j]);
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
    failed.tolerances = e.tolerances;
    const auto says = [&](const std::string& words) { return failed.failure.find(words) != std::string::npos; };
    if (step_limit_ > 0 &&
        (says(fmt::format("after {} steps", step_limit_)) || says(fmt::format("the limit of {} ", step_limit_))))
      failed.failure +=
          fmt::format(" The limit is {:g} times the steps of the evaluations before (--step-limit-factor).",
                      options_.step_limit_factor);
    e = std::move(failed);
  }
  e.warnings = said.all();
  e.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void Evaluator::evaluate(OptimizerEvaluation& e, const std::vector<OptimizerEvaluation>& before) {
  limit_steps(before);
  if (!before.empty()) e.tolerances = before.back().tolerances;
  e.tolerances.resize(design_.cases.size());
  std::vector<CaseValues> values(design_.cases.size());
  for_each_job(values.size(), jobs(), [&](std::size_t i) {
    const DesignCase& c = design_.cases[i];
    try {
      if (c.located)
        c.located([&] { values[i] = run(i, e); });
      else
        values[i] = run(i, e);
    } catch (const SolverError& failure) {
      if (c.name.empty()) throw;
      throw SolverError(c.title() + failure.what());
    } catch (const Error& failure) {  // of the first evaluation it keeps its type
      if (c.name.empty() || e.index == 1) throw;
      throw SolverError(c.title() + failure.what());
    }
  });
  combine(e, values);
  for (std::size_t j = 0; j < e.rho.size(); ++j) {
    const Parameter& p = design_.parameters.parameters[j];
    // |P(x - g) - x|, of which x - g must not round a small g away.
    const double x = e.rho[j] / p.scale, g = std::abs(e.gradient[j] * p.scale);
    const double room = e.gradient[j] > 0 ? x - p.lower / p.scale : p.upper / p.scale - x;
    e.projected_gradient = std::max(e.projected_gradient, std::min(g, std::max(room, 0.0)));
  }
}

Evaluator::CaseValues Evaluator::run(std::size_t index, OptimizerEvaluation& e) {
  const DesignCase& c = design_.cases[index];
  Problem problem = c.problem;
  if (e.rtol > 0) problem.solver.set_rtol(e.rtol);
  AbsoluteTolerances& tolerances = e.tolerances[index];
  if (tolerances.atol > 0) problem.solver.set_absolute(tolerances);
  if (step_limit_ > 0) problem.solver.max_steps = std::min(problem.solver.max_steps, step_limit_);
  problem.solver.confirm = false;  // step by step; of the optimum the certificate asks more
  const std::vector<double> rho = c.own(e.rho);
  if (c.admit) c.admit(rho);
  const bool first = e.index == 1;
  const auto run = [&](const std::string& what) {
    std::vector<std::string> said;  // of others, which are not for a smaller tolerance to take back
    if (first) said = take_notices();
    GradientResult r = gradient(problem, c.method, rho);
    // A psi that falls far below its first value is compared with that, and another tolerance would be another function
    // to the line search: the first one's size decides, for all that follow.
    if (first && resolve_small_psi(problem, r, [&](const Problem& p) { return gradient(p, c.method, rho); }))
      tolerances = problem.solver.absolute_by_rtol();
    require_finite(problem, r, what);
    if (first)
      for (auto& sentence : take_notices()) said.push_back(std::move(sentence));
    for (const auto& sentence : said) notice(sentence);
    return r;
  };
  CaseValues v;
  v.cost = run("psi");
  for (const auto& k : c.constraints) {
    problem.objective = k.objective;
    v.constraints.push_back(run(fmt::format("the constraint '{}'", k.name)));
  }
  return v;
}

void Evaluator::combine(OptimizerEvaluation& e, const std::vector<CaseValues>& values) const {
  const std::size_t n = e.rho.size();
  for (const CaseValues& v : values) e.counters += v.cost.counters;
  if (!design_.several()) {
    e.psi = values.front().cost.psi;
    if (values.front().cost.known_error) e.psi_error = values.front().cost.known_error->psi;
    e.gradient = values.front().cost.gradient;
  } else {
    for (std::size_t i = 0; i < values.size(); ++i) {
      e.cases.push_back(values[i].cost.psi);
      e.case_gradients.push_back(design_.cases[i].spread(values[i].cost.gradient, n));
    }
    design_.combine(e.cases, e.case_gradients, e.psi, e.gradient);
  }
  std::vector<std::size_t> next(values.size(), 0);
  for (const DesignBound& b : bounds_) {
    const GradientResult& r = b.constraint ? values[b.of].constraints[next[b.of]++] : values[b.of].cost;
    e.constraints.push_back(r.psi - b.upper);
    e.constraint_gradients.push_back(design_.cases[b.of].spread(r.gradient, n));
  }
}

void Evaluator::limit_steps(const std::vector<OptimizerEvaluation>& before) {
  step_limit_ = 0;
  long most = 0;
  for (const auto& e : before)
    if (!e.failed()) most = std::max({most, e.counters.steps, e.counters.backward_steps});
  if (most == 0 || options_.step_limit_factor <= 0) return;
  const double limit = std::max(static_cast<double>(OptimizerOptions::kStepsAlwaysAllowed),
                                options_.step_limit_factor * static_cast<double>(most));
  long allowed = 0;  // where the solvers' own limits are below, those hold
  for (const DesignCase& c : design_.cases) allowed = std::max(allowed, c.problem.solver.max_steps);
  if (limit < static_cast<double>(allowed)) step_limit_ = static_cast<long>(limit);
}

}  // namespace costate
