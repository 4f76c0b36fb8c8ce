#include "costate/optimize/optimizer.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <exception>
#include <nlopt.hpp>
#include <optional>

#include "costate/base/error.h"
#include "costate/integrator/fixed_run.h"
#include "costate/sensitivity/method.h"

namespace costate {

namespace {

nlopt::algorithm algorithm_of(const std::string& name, bool constrained) {
  if (name == "lbfgs") {
    if (constrained)
      throw CapabilityError("L-BFGS handles bounds but no constraints; choose algorithm 'mma' or 'slsqp'.");
    return nlopt::LD_LBFGS;
  }
  if (name == "mma") return nlopt::LD_MMA;
  if (name == "slsqp") return nlopt::LD_SLSQP;
  throw CapabilityError(fmt::format("There is no optimization algorithm '{}'.{}", name,
                                    suggestion(name, {"lbfgs", "mma", "slsqp"})));
}

/// Raised inside the objective to end a run by a criterion that NLopt does not know.
struct Stop {
  std::string reason;
  std::size_t evaluation = 0;  // where the criterion was met
};

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
      x.push_back(p.value / p.scale);
      lower.push_back(p.lower / p.scale);
      upper.push_back(p.upper / p.scale);
    }
    opt.set_lower_bounds(lower);
    opt.set_upper_bounds(upper);
    opt.set_min_objective(
        [](const std::vector<double>& at, std::vector<double>& gradient, void* self) {
          return static_cast<Run*>(self)->objective(at, gradient);
        },
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
    opt.set_maxeval(options_.max_evaluations);
    opt.set_ftol_rel(options_.relative_tolerance);
    opt.set_stopval(options_.stop_value);
    if (options_.algorithm == "lbfgs") opt.set_vector_storage(static_cast<unsigned>(options_.corrections));
    opt_ = &opt;
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
    if (error_) std::rethrow_exception(error_);
    if (stop_) {
      result_.stop_reason = stop_->reason;
      result_.converged = true;
    }
    pick_best();
    return result_;
  }

 private:
  std::string reason_of(nlopt::result r) {
    result_.converged = true;
    switch (r) {
      case nlopt::STOPVAL_REACHED:
        return fmt::format("stop value: psi fell to {:g} or below", options_.stop_value);
      case nlopt::FTOL_REACHED:
        return fmt::format("relative tolerance: psi changed by less than {:g} of itself", options_.relative_tolerance);
      case nlopt::XTOL_REACHED:
        return "parameter tolerance: the step became negligible";
      case nlopt::MAXEVAL_REACHED:
        result_.converged = false;
        return fmt::format("limit: {} evaluations", options_.max_evaluations);
      default:
        return "success";
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
      if (e->rho == rho) return *e;
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
      const GradientResult r = gradient(problem_, method_, e.rho);
      e.psi = r.psi;
      e.gradient = r.gradient;
      e.counters = r.counters;
      for (const auto& c : constraints_) {
        Problem p = problem_;
        p.objective = c.objective;
        const GradientResult rc = gradient(p, method_, e.rho);
        e.constraints.push_back(rc.psi - c.upper);
        e.constraint_gradients.push_back(rc.gradient);
      }
    } catch (const SolverError& failure) {
      std::string where;
      for (std::size_t j = 0; j < e.rho.size(); ++j)
        where += fmt::format("{}{} = {:.9g}", j ? ", " : "", problem_.parameters.parameters[j].name, e.rho[j]);
      throw SolverError(fmt::format("Evaluation {} at {}: {}", e.index, where, failure.what()));
    }
    for (std::size_t j = 0; j < e.rho.size(); ++j) {
      const Parameter& p = problem_.parameters.parameters[j];
      const double x = e.rho[j] / p.scale, g = e.gradient[j] * p.scale;
      const double moved = std::clamp(x - g, p.lower / p.scale, p.upper / p.scale);
      e.projected_gradient = std::max(e.projected_gradient, std::abs(moved - x));
    }
    e.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }

  template <class Function>
  double guarded(Function&& f) {
    // NLopt's wrapper lets exceptions of unknown type end the run in its own way; keep ours and stop it cleanly. Its line
    // search asks on after that, and is not answered.
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

  double objective(const std::vector<double>& x, std::vector<double>& g) {
    return guarded([&] {
      const OptimizerEvaluation& e = at(x);
      for (std::size_t j = 0; j < g.size(); ++j) g[j] = e.gradient[j] * problem_.parameters.parameters[j].scale;
      if (options_.gradient_tolerance > 0 && constraints_.empty() &&
          e.projected_gradient <= options_.gradient_tolerance)
        throw Stop{fmt::format("gradient tolerance: the projected gradient fell to {:.3g}", e.projected_gradient),
                   static_cast<std::size_t>(e.index - 1)};
      return e.psi;
    });
  }

  double constraint(std::size_t c, const std::vector<double>& x, std::vector<double>& g) {
    return guarded([&] {
      const OptimizerEvaluation& e = at(x);
      for (std::size_t j = 0; j < g.size(); ++j)
        g[j] = e.constraint_gradients[c][j] * problem_.parameters.parameters[j].scale;
      return e.constraints[c];
    });
  }

  void pick_best() {
    double least = std::numeric_limits<double>::infinity(), least_violation = least;
    for (std::size_t i = 0; i < result_.evaluations.size(); ++i) {
      const auto& e = result_.evaluations[i];
      double violation = 0;
      for (std::size_t c = 0; c < e.constraints.size(); ++c)
        violation = std::max(violation, e.constraints[c] / std::max(1.0, std::abs(constraints_[c].upper)) - 1e-8);
      if (violation < least_violation || (violation == least_violation && e.psi < least)) {
        least_violation = violation;
        least = e.psi;
        result_.best = i;
      }
    }
    // Where the gradient vanishes psi is flat, and the least of its values is chance: within psi's own error the point where
    // the gradient met its tolerance is the better one.
    if (stop_ && result_.evaluations[stop_->evaluation].psi - least <= 100 * problem_.solver.rtol * std::abs(least))
      result_.best = stop_->evaluation;
  }

  const Problem& problem_;
  const std::string& method_;
  const std::vector<OptimizerConstraint>& constraints_;
  const OptimizerOptions& options_;
  const std::vector<OptimizerEvaluation>& replay_;
  const std::function<void(const OptimizerEvaluation&)>& record_;
  bool replaying_;
  nlopt::opt* opt_ = nullptr;
  OptimizerResult result_;
  std::optional<Stop> stop_;
  std::exception_ptr error_;
};

}  // namespace

std::string nlopt_version_text() {
  return fmt::format("{}.{}.{}", nlopt::version_major(), nlopt::version_minor(), nlopt::version_bugfix());
}

void require_algorithm(const std::string& algorithm, bool constrained) { algorithm_of(algorithm, constrained); }

OptimizerResult optimize(const Problem& problem, const std::string& method,
                         const std::vector<OptimizerConstraint>& constraints, const OptimizerOptions& options,
                         const std::vector<OptimizerEvaluation>& replay,
                         const std::function<void(const OptimizerEvaluation&)>& record) {
  // Fixed steps are chosen once: psi and the constraints of all evaluations are those of one discretization.
  const bool discrete = find_sensitivity_method(method).needs == SensitivityMethod::Needs::discrete;
  const Problem stepped = discrete ? with_fixed_step(problem) : problem;
  return Run(stepped, method, constraints, options, replay, record).solve();
}

}  // namespace costate
