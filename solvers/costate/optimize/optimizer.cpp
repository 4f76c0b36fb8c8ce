#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <nlopt.hpp>
#include <optional>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/optimize/adapted_tolerance.h"
#include "costate/optimize/algorithms.h"
#include "costate/optimize/bound_size.h"
#include "costate/optimize/evaluator.h"
#include "costate/optimize/failed_step.h"
#include "costate/optimize/kept_point.h"
#include "costate/optimize/optimizer_run.h"
#include "costate/optimize/optimizer_unit.h"
#include "costate/optimize/stop_reason.h"
#include "costate/record/interrupt.h"

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
  Run(const Design& design, const OptimizerOptions& options, const std::vector<OptimizerEvaluation>& replay,
      const std::function<void(const OptimizerEvaluation&)>& record)
      : design_(design),
        parameters_(design.parameters.parameters),
        bounds_(design.bounds()),
        options_(options),
        replay_(replay),
        record_(record),
        evaluator_(design, options),
        tolerance_(design.rtol(), options.adapt_accuracy),
        replaying_(!replay.empty()) {}

  OptimizerResult solve() {
    search();
    conclude([&](std::size_t best) {
      if (const auto rho = nearest_kept_point(result_.evaluations, best, design_); rho && !stop_) evaluate_new(*rho);
    });
    // The result is of the problem's tolerance, wherever it ended.
    conclude([&](std::size_t best) {
      if (result_.evaluations[best].rtol > design_.rtol()) tighten(best, design_.rtol());
    });
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
    } else if (result_.evaluations.back().failed() && !result_.evaluations.back().ending) {
      result_.converged = false;
      result_.stop_reason = no_step_evaluated(result_.evaluations.back());
    } else if (result_.stop_reason.empty()) {
      result_.stop_reason = conditions_hold(result_.evaluations[*best], !bounds_.empty() || design_.minimax());
    }
    prefer_flat();
    return result_;
  }

 private:
  void search() {
    const std::size_t n = parameters_.size();
    if (n == 0) throw Error("There is no parameter to optimize: name some with --parameters or in [run].");
    const nlopt::algorithm algorithm = algorithm_of(options_.algorithm, !bounds_.empty() || design_.minimax());
    std::vector<double> x, lower, upper;
    scaled_start(design_.parameters, x, lower, upper);
    if (!begin(x)) return;
    if (design_.minimax()) begin_epigraph(x, lower, upper);
    nlopt::opt opt(algorithm, static_cast<unsigned>(x.size()));
    opt.set_lower_bounds(lower);
    opt.set_upper_bounds(upper);
    opt.set_min_objective([](const std::vector<double>& at, std::vector<double>& gradient,
                             void* self) { return static_cast<Run*>(self)->objective(at, gradient); },
                          this);
    const std::size_t rows = design_.minimax() ? design_.targets.size() : 0;  // of the epigraph, behind the others
    std::vector<std::pair<Run*, std::size_t>> handles;
    handles.reserve(bounds_.size() + rows);
    for (std::size_t c = 0; c < bounds_.size() + rows; ++c) {
      handles.emplace_back(this, c);
      opt.add_inequality_constraint(
          [](const std::vector<double>& at, std::vector<double>& gradient, void* handle) {
            const auto& [run, index] = *static_cast<std::pair<Run*, std::size_t>*>(handle);
            return index < run->bounds_.size() ? run->constraint(index, at, gradient)
                                               : run->epigraph(index - run->bounds_.size(), at, gradient);
          },
          &handles[c],
          c < bounds_.size() ? kept_within(sizes_[c], bounds_[c].upper, design_.rtol()) / units_.constraints[c]
                             : 1e-10);
    }
    // The limit of evaluations is ours: NLopt looks at its own only between line searches, and chooses the memory of
    // L-BFGS from it.
    opt.set_ftol_rel(options_.relative_tolerance);
    if (rows == 0) opt.set_ftol_abs(kNothingOfStart * std::abs(result_.evaluations.front().psi / units_.psi));
    if (options_.stop_value && !tolerance_.adapting() && rows == 0) opt.set_stopval(*options_.stop_value / units_.psi);
    if (opt.get_algorithm() == nlopt::LD_LBFGS) opt.set_vector_storage(static_cast<unsigned>(options_.corrections));
    double psi = 0;
    try {
      result_.stop_reason = reason_of(opt.optimize(x, psi), options_);
      const std::vector<OptimizerEvaluation>& list = result_.evaluations;
      const std::size_t best = *best_before(list.size());
      result_.converged = !ended_elsewhere(list, best);
      if (!result_.converged)
        result_.stop_reason = fmt::format(
            "{}; but that was where psi is {:.6g}, far above its best, evaluation {}",
            result_.stop_reason.empty() ? "optimality: the optimizer's conditions hold" : result_.stop_reason,
            list.back().psi, list[best].index);
    } catch (const nlopt::forced_stop&) {
      // Ours; told below.
    } catch (const nlopt::roundoff_limited&) {
      result_.stop_reason = "rounding: no further decrease of psi can be told from rounding errors";
      result_.converged = true;
    } catch (const std::runtime_error&) {
      result_.stop_reason = "line search: the optimizer found no further decrease along its search direction";
    }
  }

  /// What follows the search, step(best); one evaluation more than the limit, if need be.
  template <class Step>
  void conclude(const Step& step) {
    const std::optional<std::size_t> best = best_before(result_.evaluations.size());
    if (error_ || !best) return;
    try {
      ending_ = true;
      step(*best);
    } catch (const Stop& stop) {
      stop_ = stop;
    } catch (...) {
      error_ = std::current_exception();
    }
  }

  /// The evaluation at scaled parameters x, computed once.
  const OptimizerEvaluation& at(const std::vector<double>& x) {
    std::vector<double> rho(parameters_.size());  // behind them there may be the epigraph's t
    for (std::size_t j = 0; j < rho.size(); ++j) {
      const Parameter& p = parameters_[j];
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
    if (!tolerance_.last() && !list.empty()) {
      const std::size_t best = *best_before(list.size());
      tighten(best, tolerance_.needed(list[best], rho, last_decrease_));
    }
    if (list.empty())
      evaluate_first(rho);
    else
      evaluate_new(rho);
    if (!tolerance_.last()) loose_evaluation();
    return list.back();
  }

  /// A tolerance may be too loose for the motion where it begins.
  void evaluate_first(const std::vector<double>& rho) {
    for (;;) try {
        return evaluate_new(rho);
      } catch (const SolverError&) {
        if (tolerance_.last()) throw;
        tolerance_.tighten_to(tolerance_.next());
      }
  }

  /// What a loose tolerance is not enough for, of the evaluation just made.
  void loose_evaluation() {
    auto& list = result_.evaluations;
    const std::size_t here = list.size() - 1;
    if (list[here].failed()) {
      const std::vector<double> rho = list[here].rho;
      tighten(*best_before(here), design_.rtol());
      evaluate_new(rho);
    } else if (!tolerance_.known()) {
      // What a tolerance's errors are is told by two.
      tighten(here, tolerance_.next());
    } else if (list[here].projected_gradient <= options_.gradient_tolerance ||
               (options_.stop_value && list[here].psi <= *options_.stop_value)) {
      tighten(here, design_.rtol());
    }
  }

  /// Goes on at this tolerance, from the same point: what NLopt has been told of it stays.
  void tighten(std::size_t point, double rtol) {
    if (rtol >= tolerance_.rtol()) return;
    tolerance_.tighten_to(rtol);
    const OptimizerEvaluation loose = result_.evaluations[point];
    const double shown = shown_[point];
    evaluate_new(loose.rho);
    const OptimizerEvaluation& tight = result_.evaluations.back();
    if (tight.failed())
      throw Stop{"a failed evaluation of the best point at a tighter tolerance: " + tight.failure, false, {}};
    tolerance_.learn(loose, tight, design_.parameters);
    offset_ = tight.psi - shown;
    shown_.back() = shown;
  }

  void evaluate_new(const std::vector<double>& rho) {
    auto& list = result_.evaluations;
    if (!ending_ && list.size() >= static_cast<std::size_t>(options_.max_evaluations))
      throw Stop{
          fmt::format("limit: {} evaluation{}", options_.max_evaluations, options_.max_evaluations == 1 ? "" : "s"),
          false,
          {}};
    OptimizerEvaluation e;
    e.index = static_cast<int>(list.size()) + 1;
    e.rho = rho;
    e.rtol = tolerance_.adapting() ? tolerance_.rtol() : 0;
    e.ending = ending_;
    if (replaying_ && list.size() < replay_.size() && replay_[list.size()].rho == rho &&
        replay_[list.size()].rtol == e.rtol) {
      const int index = e.index;
      e = replay_[list.size()];
      e.index = index;
      e.replayed = true;
      for (const std::string& sentence : e.warnings) notice(sentence);
    } else {
      replaying_ = false;
      evaluator_.compute(e, list);
    }
    const std::optional<std::size_t> before = best_before(list.size());
    if (before && !e.failed() && e.rtol == list[*before].rtol && e.psi < list[*before].psi)
      last_decrease_ = list[*before].psi - e.psi;
    shown_.push_back(e.psi - offset_);
    list.push_back(std::move(e));
    if (record_) record_(list.back());
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
    return FailedStep(design_.parameters, result_.evaluations, here, *best_before(here));
  }

  double objective(const std::vector<double>& x, std::vector<double>& g) {
    return guarded([&] {
      const OptimizerEvaluation& e = at(x);
      if (design_.minimax()) {
        if (options_.stop_value && !e.failed() && e.psi <= *options_.stop_value)
          throw Stop{low_enough(options_), true, static_cast<std::size_t>(e.index - 1)};
        std::fill(g.begin(), g.end(), 0.0);
        if (!g.empty()) g.back() = 1;
        return x.back();
      }
      if (e.failed()) {
        const FailedStep step = failed_step(e);
        step.gradient(step.slope() / units_.psi, g);
        return (step.psi() - offset_) / units_.psi;
      }
      scale_to(g, e.gradient, units_.psi);
      if (options_.gradient_tolerance > 0 && bounds_.empty() && e.projected_gradient <= options_.gradient_tolerance)
        throw Stop{fmt::format("gradient tolerance: the projected gradient fell to {:.3g}", e.projected_gradient), true,
                   static_cast<std::size_t>(e.index - 1)};
      if (tolerance_.adapting() && options_.stop_value && e.psi <= *options_.stop_value)
        throw Stop{low_enough(options_), true, static_cast<std::size_t>(e.index - 1)};
      return shown_[static_cast<std::size_t>(e.index - 1)] / units_.psi;
    });
  }

  double constraint(std::size_t c, const std::vector<double>& x, std::vector<double>& g) {
    return guarded([&] {
      const OptimizerEvaluation& e = at(x);
      if (e.failed()) {
        const FailedStep step = failed_step(e);
        step.gradient(step.constraint_rise(c, sizes_[c]) / units_.constraints[c], g);
        return step.constraint(c, sizes_[c]) / units_.constraints[c];
      }
      scale_to(g, e.constraint_gradients[c], units_.constraints[c]);
      return e.constraints[c] / units_.constraints[c];
    });
  }

  /// The first evaluation, and the units that NLopt sees: whether there is one.
  bool begin(const std::vector<double>& x) {
    try {
      const OptimizerEvaluation& first = at(x);
      units_ = optimizer_units(design_.parameters, first, bounds_);
      sizes_ = bound_sizes(design_.parameters, first, bounds_);
    } catch (const Stop& stop) {
      stop_ = stop;
    } catch (...) {
      error_ = std::current_exception();
    }
    return !stop_ && !error_;
  }

  /// The start (x, t) of the least t with target_g(x) <= t for all g, t in units of psi's size there.
  void begin_epigraph(std::vector<double>& x, std::vector<double>& lower, std::vector<double>& upper) {
    const OptimizerEvaluation& first = result_.evaluations.front();
    size_ = first.psi != 0 ? std::abs(first.psi) : 1;
    x.push_back(first.psi / size_);
    lower.push_back(-HUGE_VAL);
    upper.push_back(HUGE_VAL);
  }

  /// target_g(x) - t.
  double epigraph(std::size_t target, const std::vector<double>& x, std::vector<double>& g) {
    return guarded([&] {
      const OptimizerEvaluation& e = at(x);
      double value = 0;
      if (e.failed()) {
        const FailedStep step = failed_step(e);
        step.gradient(step.slope() / size_, g);
        value = step.psi();
      } else {
        if (!g.empty()) scale_to(g, design_.target_gradient(target, e.case_gradients), size_);
        value = design_.target(target, e.cases);
      }
      if (!g.empty()) g.back() = -1;
      return value / size_ - x.back();
    });
  }

  /// g := the gradient by scaled parameters, over `size`; entries behind are zero.
  void scale_to(std::vector<double>& g, const std::vector<double>& gradient, double size) const {
    for (std::size_t j = 0; j < g.size(); ++j)
      g[j] = j < gradient.size() ? gradient[j] * parameters_[j].scale / size : 0.0;
  }

  std::optional<std::size_t> best_before(std::size_t count) const {
    return best_evaluation(result_.evaluations, count, design_);
  }

  /// Where the gradient vanishes psi is flat, and the least of its values is chance: within psi's own error the point
  /// where the gradient met its tolerance is the better one.
  void prefer_flat() {
    if (!stop_ || !stop_->evaluation) return;
    const double least = result_.evaluations[result_.best].psi;
    if (result_.evaluations[*stop_->evaluation].psi - least <= 100 * design_.rtol() * std::abs(least))
      result_.best = *stop_->evaluation;
  }

  const Design& design_;
  const std::vector<Parameter>& parameters_;
  const std::vector<DesignBound> bounds_;
  const OptimizerOptions& options_;
  const std::vector<OptimizerEvaluation>& replay_;
  const std::function<void(const OptimizerEvaluation&)>& record_;
  Evaluator evaluator_;
  AdaptedTolerance tolerance_;
  std::vector<double> shown_;  // psi as the optimizer sees it, by evaluation
  double offset_ = 0;          // of psi against that
  double last_decrease_ = 0;   // of psi at one tolerance
  double size_ = 1;            // of psi, for the epigraph
  OptimizerUnits units_;
  std::vector<double> sizes_;  // of the constraints
  bool ending_ = false;
  bool replaying_;
  int repeated_ = 0;
  OptimizerResult result_;
  std::optional<Stop> stop_;
  std::exception_ptr error_;
};

}  // namespace

OptimizerResult run_optimizer(const Design& design, const OptimizerOptions& options,
                              const std::vector<OptimizerEvaluation>& replay,
                              const std::function<void(const OptimizerEvaluation&)>& record) {
  return Run(design, options, replay, record).solve();
}

}  // namespace costate
