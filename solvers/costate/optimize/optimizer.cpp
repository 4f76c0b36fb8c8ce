#include "costate/optimize/optimizer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <nlopt.hpp>
#include <optional>

#include "costate/base/error.h"
#include "costate/integrator/fixed_run.h"
#include "costate/optimize/algorithms.h"
#include "costate/optimize/failed_step.h"
#include "costate/record/interrupt.h"
#include "costate/sensitivity/method.h"

namespace costate {

namespace {

/// Raised inside the objective to end a run by a criterion that NLopt does not know.
struct Stop {
  std::string reason;
  bool converged = true;
  std::optional<std::size_t> evaluation;  // where the criterion was met
};

/// How often NLopt may ask in a row for points that are known already.
constexpr int kRepetitions = 1000;

class Run {
 public:
  Run(const Problem& problem, const std::string& method, const std::vector<OptimizerConstraint>& constraints,
      const OptimizerOptions& options, const std::vector<OptimizerEvaluation>& replay,
      const std::function<void(const OptimizerEvaluation&)>& record)
      : problem_(problem),
        method_(method),
        constraints_(constraints),
        options_(options),
        replay_(replay),
        record_(record),
        replaying_(!replay.empty()) {}

  OptimizerResult solve() {
    const auto& parameters = problem_.parameters.parameters;
    const auto n = static_cast<unsigned>(parameters.size());
    if (n == 0) throw Error("There is no parameter to optimize: name some with --parameters or in [run].");
    nlopt::opt opt(algorithm_of(options_.algorithm, !constraints_.empty()), n);
    std::vector<double> x, lower, upper;
    for (const Parameter& p : parameters) {
      if (!(p.value >= p.lower && p.value <= p.upper))
        throw ModelError(
            "parameter." + p.name,
            fmt::format("The optimization would start at {}, outside the bounds {} .. {}.", p.value, p.lower, p.upper));
      x.push_back(p.value / p.scale);
      lower.push_back(p.lower / p.scale);
      upper.push_back(p.upper / p.scale);
    }
    opt.set_lower_bounds(lower);
    opt.set_upper_bounds(upper);
    opt.set_min_objective([](const std::vector<double>& at, std::vector<double>& gradient,
                             void* self) { return static_cast<Run*>(self)->objective(at, gradient); },
                          this);
    std::vector<std::pair<Run*, std::size_t>> handles;
    handles.reserve(constraints_.size());
    for (std::size_t c = 0; c < constraints_.size(); ++c) {
      handles.emplace_back(this, c);
      opt.add_inequality_constraint(
          [](const std::vector<double>& at, std::vector<double>& gradient, void* handle) {
            const auto& [run, index] = *static_cast<std::pair<Run*, std::size_t>*>(handle);
            return run->constraint(index, at, gradient);
          },
          &handles[c], 1e-8 * std::max(1.0, std::abs(constraints_[c].upper)));
    }
    // The limit of evaluations is ours: NLopt looks at its own only between line searches, and chooses the memory of
    // L-BFGS from it.
    opt.set_ftol_rel(options_.relative_tolerance);
    if (options_.stop_value) opt.set_stopval(*options_.stop_value);
    if (opt.get_algorithm() == nlopt::LD_LBFGS) opt.set_vector_storage(static_cast<unsigned>(options_.corrections));
    double psi = 0;
    try {
      result_.stop_reason = reason_of(opt.optimize(x, psi));
    } catch (const nlopt::forced_stop&) {
      // Ours; told below.
    } catch (const nlopt::roundoff_limited&) {
      result_.stop_reason = "rounding: no further decrease of psi can be told from rounding errors";
      result_.converged = true;
    } catch (const std::runtime_error&) {
      result_.stop_reason = "line search: the optimizer found no further decrease along its search direction";
    }
    const std::optional<std::size_t> best = best_before(result_.evaluations.size());
    if (error_ && !best) std::rethrow_exception(error_);
    result_.best = *best;
    if (error_) {
      result_.error = error_;
      result_.converged = false;
      result_.stop_reason = "an error: " + message_of(error_);
    } else if (stop_) {
      result_.stop_reason = stop_->reason;
      result_.converged = stop_->converged;
    } else if (result_.evaluations.back().failed()) {
      result_.converged = false;
      result_.stop_reason = fmt::format(
          "failed evaluations: no step from the best point led to one that could be evaluated; "
          "the last: {}",
          result_.evaluations.back().failure);
    } else if (result_.stop_reason.empty()) {
      result_.stop_reason = constraints_.empty()
                                ? fmt::format(
                                      "optimality: to first order nothing is left to gain, the projected gradient is "
                                      "{:.3g}",
                                      result_.evaluations[*best].projected_gradient)
                                : "optimality: the optimizer's conditions of first order hold";
    }
    prefer_flat();
    return result_;
  }

 private:
  std::string reason_of(nlopt::result r) {
    result_.converged = true;
    switch (r) {
      case nlopt::STOPVAL_REACHED:
        return fmt::format("stop value: psi fell to {:g} or below", *options_.stop_value);
      case nlopt::FTOL_REACHED:
        return fmt::format("relative tolerance: psi changed by less than {:g} of itself", options_.relative_tolerance);
      case nlopt::XTOL_REACHED:
        return "parameter tolerance: the step became negligible";
      default:
        return {};  // told by solve()
    }
  }

  static std::string message_of(const std::exception_ptr& error) {
    try {
      std::rethrow_exception(error);
    } catch (const std::exception& e) {
      return e.what();
    } catch (...) {
      return "unknown";
    }
  }

  /// The evaluation at scaled parameters x, computed once.
  const OptimizerEvaluation& at(const std::vector<double>& x) {
    std::vector<double> rho(x.size());
    for (std::size_t j = 0; j < x.size(); ++j) {
      const Parameter& p = problem_.parameters.parameters[j];
      rho[j] = std::clamp(x[j] * p.scale, p.lower, p.upper);  // scaling back may miss a bound by rounding
    }
    auto& list = result_.evaluations;
    for (auto e = list.rbegin(); e != list.rend(); ++e)
      if (e->rho == rho) {
        if (++repeated_ > kRepetitions)
          throw Stop{"line search: the optimizer asked for nothing but points that it knows", false, {}};
        return *e;
      }
    repeated_ = 0;
    if (list.size() >= static_cast<std::size_t>(options_.max_evaluations))
      throw Stop{
          fmt::format("limit: {} evaluation{}", options_.max_evaluations, options_.max_evaluations == 1 ? "" : "s"),
          false,
          {}};
    OptimizerEvaluation e;
    e.index = static_cast<int>(list.size()) + 1;
    e.rho = rho;
    if (replaying_ && list.size() < replay_.size() && replay_[list.size()].rho == rho) {
      const int index = e.index;
      e = replay_[list.size()];
      e.index = index;
      e.replayed = true;
    } else {
      replaying_ = false;
      compute(e);
    }
    list.push_back(std::move(e));
    if (record_) record_(list.back());
    return list.back();
  }

  void compute(OptimizerEvaluation& e) {
    const auto begin = std::chrono::steady_clock::now();
    try {
      evaluate(e);
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

  void evaluate(OptimizerEvaluation& e) {
    Problem problem = problem_;
    limit_steps(problem.solver);
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

  /// A run that needs many times the steps of its neighbours is stuck somewhere.
  void limit_steps(SolverOptions& solver) {
    step_limit_ = 0;
    long most = 0;
    for (const auto& e : result_.evaluations)
      if (!e.failed()) most = std::max({most, e.counters.steps, e.counters.backward_steps});
    if (most == 0 || options_.step_limit_factor <= 0) return;
    const double limit = std::max(static_cast<double>(OptimizerOptions::kStepsAlwaysAllowed),
                                  options_.step_limit_factor * static_cast<double>(most));
    if (limit < static_cast<double>(solver.max_steps)) solver.max_steps = step_limit_ = static_cast<long>(limit);
  }

  void require_finite(const GradientResult& r, const std::string& what) const {
    if (!std::isfinite(r.psi)) throw SolverError(fmt::format("{} is {}, not a finite number.", what, r.psi));
    for (std::size_t j = 0; j < r.gradient.size(); ++j)
      if (!std::isfinite(r.gradient[j]))
        throw SolverError(fmt::format("The derivative of {} with respect to {} is {}, not a finite number.", what,
                                      problem_.parameters.parameters[j].name, r.gradient[j]));
  }

  template <class Function>
  double guarded(Function&& f) {
    // NLopt's wrapper lets exceptions of unknown type end the run in its own way; keep ours and stop it cleanly. Its
    // line search asks on after that, and is not answered.
    if (stop_ || error_) throw nlopt::forced_stop();
    try {
      return f();
    } catch (const Stop& stop) {
      stop_ = stop;
    } catch (...) {
      error_ = std::current_exception();
    }
    throw nlopt::forced_stop();
  }

  FailedStep failed_step(const OptimizerEvaluation& failed) const {
    const auto here = static_cast<std::size_t>(failed.index - 1);
    return FailedStep(problem_.parameters, result_.evaluations, here, *best_before(here));
  }

  double objective(const std::vector<double>& x, std::vector<double>& g) {
    return guarded([&] {
      const OptimizerEvaluation& e = at(x);
      if (e.failed()) {
        const FailedStep step = failed_step(e);
        step.gradient(step.slope(), g);
        return step.psi();
      }
      for (std::size_t j = 0; j < g.size(); ++j) g[j] = e.gradient[j] * problem_.parameters.parameters[j].scale;
      if (options_.gradient_tolerance > 0 && constraints_.empty() &&
          e.projected_gradient <= options_.gradient_tolerance)
        throw Stop{fmt::format("gradient tolerance: the projected gradient fell to {:.3g}", e.projected_gradient), true,
                   static_cast<std::size_t>(e.index - 1)};
      return e.psi;
    });
  }

  double constraint(std::size_t c, const std::vector<double>& x, std::vector<double>& g) {
    return guarded([&] {
      const OptimizerEvaluation& e = at(x);
      if (e.failed()) {
        const FailedStep step = failed_step(e);
        step.gradient(step.constraint_rise(c, constraints_[c].upper), g);
        return step.constraint(c, constraints_[c].upper);
      }
      for (std::size_t j = 0; j < g.size(); ++j)
        g[j] = e.constraint_gradients[c][j] * problem_.parameters.parameters[j].scale;
      return e.constraints[c];
    });
  }

  /// The best of the first `count` evaluations: the least violation of the constraints, then the least psi.
  std::optional<std::size_t> best_before(std::size_t count) const {
    std::optional<std::size_t> best;
    double least = std::numeric_limits<double>::infinity(), least_violation = least;
    for (std::size_t i = 0; i < count; ++i) {
      const auto& e = result_.evaluations[i];
      if (e.failed()) continue;
      double violation = 0;
      for (std::size_t c = 0; c < e.constraints.size(); ++c)
        violation = std::max(violation, e.constraints[c] / std::max(1.0, std::abs(constraints_[c].upper)) - 1e-8);
      if (violation < least_violation || (violation == least_violation && e.psi < least)) {
        least_violation = violation;
        least = e.psi;
        best = i;
      }
    }
    return best;
  }

  /// Where the gradient vanishes psi is flat, and the least of its values is chance: within psi's own error the point
  /// where the gradient met its tolerance is the better one.
  void prefer_flat() {
    if (!stop_ || !stop_->evaluation) return;
    const double least = result_.evaluations[result_.best].psi;
    if (result_.evaluations[*stop_->evaluation].psi - least <= 100 * problem_.solver.rtol * std::abs(least))
      result_.best = *stop_->evaluation;
  }

  const Problem& problem_;
  const std::string& method_;
  const std::vector<OptimizerConstraint>& constraints_;
  const OptimizerOptions& options_;
  const std::vector<OptimizerEvaluation>& replay_;
  const std::function<void(const OptimizerEvaluation&)>& record_;
  bool replaying_;
  int repeated_ = 0;
  long step_limit_ = 0;  // of the evaluation being made; 0: the solver's own
  OptimizerResult result_;
  std::optional<Stop> stop_;
  std::exception_ptr error_;
};

}  // namespace

std::size_t OptimizerResult::failures() const {
  return static_cast<std::size_t>(
      std::count_if(evaluations.begin(), evaluations.end(), [](const auto& e) { return e.failed(); }));
}

OptimizerResult optimize(const Problem& problem, const std::string& method,
                         const std::vector<OptimizerConstraint>& constraints, const OptimizerOptions& options,
                         const std::vector<OptimizerEvaluation>& replay,
                         const std::function<void(const OptimizerEvaluation&)>& record) {
  // Fixed steps are chosen once: psi and the constraints of all evaluations are those of one discretization.
  const bool fixed = by_fixed_steps(problem, find_sensitivity_method(method));
  const Problem stepped = fixed ? with_fixed_step(problem) : problem;
  return Run(stepped, method, constraints, options, replay, record).solve();
}

}  // namespace costate
