#include "costate/integrator/fixed_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "costate/analysis/not_finite.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/integrator/run_watch.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/problem/known_error.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {

constexpr long kFirstTrial = 32;
constexpr long kLastTrial = 1L << 18;
constexpr long kPoll = 64;  // steps between calls of the monitor

/// What a trial run is judged by: psi, or without a cost the positions at the end.
std::vector<double> trial(const Problem& problem, const std::vector<double>& rho, long steps) {
  FixedRun run(problem, rho, steps, StartDerivative::none);
  const double psi = run.forward();
  if (!problem.objective.running.empty() || !problem.objective.terminal.empty()) return {psi};
  const StateView s = run.scheme().state();
  return std::vector<double>(s.q, s.q + run.scheme().assembly().n());
}

/// What is as good as nothing, of a cost or of coordinates.
double nothing(const Problem& problem) {
  constexpr double kPart = 1e-4;  // of what is absolutely tolerated
  const bool cost = !problem.objective.running.empty() || !problem.objective.terminal.empty();
  return problem.solver.absolute() * (cost ? kPart * cost_size(*problem.mechanism) : length_size(*problem.mechanism));
}

/// |a - b| / |b| in the largest entries.
double change(const std::vector<double>& a, const std::vector<double>& b, double smallest) {
  double difference = 0, size = smallest;
  for (std::size_t i = 0; i < b.size(); ++i) {
    difference = std::max(difference, std::abs(a[i] - b[i]));
    size = std::max(size, std::abs(b[i]));
  }
  return difference / size;
}

long chosen_steps(const Problem& problem) {
  const double wanted = 0.1 * std::sqrt(problem.solver.rtol);
  const std::vector<double> rho = problem.parameters.values();
  std::vector<double> before;
  double error_before = 0;
  long fewest = 0;  // steps that carried the motion: with fewer it may pass over something (StepPlan)
  std::string failure;
  std::exception_ptr cause;
  for (long steps = kFirstTrial; steps <= std::min(kLastTrial, problem.solver.max_steps); steps *= 2) {
    std::vector<double> now;
    try {
      now = trial(problem, rho, steps);
    } catch (const SolverError& e) {  // too coarse, perhaps
      failure = e.what();
      cause = std::current_exception();
      before.clear();
      error_before = 0;
      fewest = 0;
      continue;
    }
    if (fewest == 0) fewest = steps;
    if (!before.empty()) {
      // Of second order: the error of the finer run is a third of the change.
      const double error = change(before, now, nothing(problem)) / 3;
      const double ratio = error > 0 ? error_before / error : 0;
      const bool settled =
          (ratio > 2.5 && ratio < 6.5) || (error <= wanted && error_before > 0 && error_before <= wanted);
      if (settled) {
        const double scaled = static_cast<double>(steps) * std::sqrt(error / wanted);
        return std::max(fewest, static_cast<long>(std::ceil(scaled)));
      }
      error_before = error;
    }
    before = std::move(now);
  }
  if (before.empty()) {
    if (cause) try {
        std::rethrow_exception(cause);
      } catch (const RunNotFinite&) {  // whatever the step
        throw;
      } catch (const SolverError&) {
      }
    throw SolverError("No step was found that carries the motion over the whole time span; the last attempt says: " +
                      failure);
  }
  return std::min(kLastTrial, problem.solver.max_steps);
}

}  // namespace

namespace {
// Of the largest scaled derivative, in sqrt(rtol): what a gradient's error may be, and what is said of one.
constexpr double kGradientError = 1, kGradientNotice = 10;
constexpr long kMostRefined = 16;  // times the steps that psi needs

/// The largest change of a scaled derivative from one gradient to the other, against the largest of them.
double change(const Problem& problem, const GradientResult& a, const GradientResult& b) {
  const double size = std::max(nothing(problem), gradient_size(problem.parameters, b.psi, b.gradient));
  return largest_scaled_change(problem.parameters, a.gradient, b.gradient) / size;
}
}  // namespace

GradientResult settle_gradient(const Problem& problem, const std::function<GradientResult(long steps)>& run) {
  const long steps = fixed_steps(problem);
  GradientResult r = run(steps);
  if (problem.solver.step_s > 0 || r.gradient.empty()) return r;
  const double wanted = std::sqrt(problem.solver.rtol);
  // Of second order: of two runs the finer one's error is their difference by (n'/n)^2 - 1.
  double error = HUGE_VAL;
  try {
    const Unsaid coarser;
    error = change(problem, run(steps / 2), r) / 3;
  } catch (const SolverError&) {  // too coarse
  }
  if (!(error <= kGradientError * wanted)) {
    // By whole doublings, so that a tangent and an adjoint that differ by rounding take the same steps.
    const double needed = std::isfinite(error) ? std::sqrt(2 * error / (kGradientError * wanted)) : 4;
    long times = 2;
    while (static_cast<double>(times) < needed && times < kMostRefined) times *= 2;
    const long finer = std::min(steps * times, problem.solver.max_steps);
    const GradientResult before = r;
    r = run(finer);
    const double ratio = static_cast<double>(finer) / static_cast<double>(steps);
    error = finer > steps ? change(problem, before, r) / (ratio * ratio - 1) : error;
  }
  if (!(error <= kGradientNotice * wanted)) {
    widen_error(r, problem.parameters, 0, error * gradient_size(problem.parameters, r.psi, r.gradient));
    notice(fmt::format(
        "Fixed steps of {:.3g} s leave an error of some {:.1g} of the largest scaled derivative in the gradient: it "
        "changed by that when they were halved. Give a smaller step (--step, run.step_s), or take an integrator with "
        "step control.",
        (problem.solver.t_end - problem.solver.t_start) / static_cast<double>(r.counters.steps), error));
  }
  return r;
}

long fixed_steps(const Problem& problem) {
  const SolverOptions& o = problem.solver;
  const double span = o.t_end - o.t_start;
  const double steps = o.step_s > 0 ? std::max(1.0, std::ceil(span / o.step_s * (1 - 1e-12)))
                                    : static_cast<double>(chosen_steps(problem));
  if (!(steps <= static_cast<double>(o.max_steps)))
    throw SolverError(
        fmt::format("Steps of {:g} s over {:g} s are {:.3g} steps, more than the limit of {}. Choose a "
                    "larger step, or a larger rtol.",
                    span / steps, span, steps, o.max_steps));
  return static_cast<long>(steps);
}

Problem with_fixed_step(const Problem& problem) {
  Problem p = problem;
  if (p.solver.step_s <= 0)
    p.solver.step_s = (p.solver.t_end - p.solver.t_start) / static_cast<double>(fixed_steps(problem));
  return p;
}

FixedRun::FixedRun(const Problem& problem, const std::vector<double>& rho, long steps, StartDerivative wanted)
    : problem_(problem),
      scheme_(problem.make_discrete()),
      steps_(steps),
      formulas_(*problem.mechanism, problem.objective, FormulaJumpWatch::Looks::whole) {
  MotionEvents::refuse(*problem.mechanism, "fixed steps are");
  scheme_->set_parameters(rho.data());
  for (const double t : scheme_->kinks())
    if (problem.solver.t_start < t && t < problem.solver.t_end)
      throw CapabilityError(
          fmt::format("A driver's law has a kink at t = {:.6g} s, where the velocities jump; fixed steps pass "
                      "it by. Take the integrator idas or cvodes (the methods that bear their names), or a "
                      "law with a continuous slope.",
                      t));
  const double span = problem.solver.t_end - problem.solver.t_start;
  scheme_->start(problem.solver.t_start, span / static_cast<double>(steps), wanted);
  plan_ = std::make_unique<StepPlan>(scheme_->assembly(), problem.objective, problem.solver.t_start,
                                     problem.solver.t_end, scheme_->state());
  WatchSettings s;
  s.rtol = problem.solver.rtol;
  s.formulation = problem.formulation;
  s.objective = problem.objective;
  s.fixed_steps = true;
  watch_ = std::make_unique<MotionWatch>(problem.mechanism, problem.parameters, rho.data(), std::move(s));
}

namespace {
/// Of fixed steps: that none of them passes over a touch, by the positions and velocities at its ends.
class FixedTouches {
 public:
  FixedTouches(Assembly& assembly, const Objective& objective, const SolverOptions& options)
      : n_(static_cast<std::size_t>(assembly.n())),
        nz_(static_cast<std::size_t>(assembly.nz())),
        touches_(assembly, objective, options.rtol, options.absolute()) {}
  void step(const StateView& s) {
    if (touches_.empty()) return;
    std::swap(before_, after_);
    after_.t = s.t;
    after_.q.assign(s.q, s.q + n_);
    after_.v.assign(s.v, s.v + n_);
    after_.z.assign(s.z, s.z + nz_);
    if (before_.q.empty()) return;
    const auto look = touches_.look(before_.t, after_.t, [this](double t) { return between(t); });
    if (look)
      throw SolverError(fmt::format(
          "A fixed step of {:.6g} s from t = {:.6g} s passes over a touch: {} {} from {:.9g} to "
          "{:.9g} s. Choose steps of {:.3g} s or less (--step, run.step_s).",
          after_.t - before_.t, before_.t, look->element->path(), look->does, look->from, look->to, look->step));
  }

 private:
  struct State {
    double t = 0;
    std::vector<double> q, v, z;
  };
  /// Hermite's cubic of q, and its rate.
  StateView between(double t) {
    const State &a = before_, &b = after_;
    const double h = b.t - a.t, x = t >= b.t ? 1 : t <= a.t ? 0 : (t - a.t) / h, y = 1 - x;
    here_.q.resize(n_);
    here_.v.resize(n_);
    for (std::size_t i = 0; i < n_; ++i) {
      here_.q[i] = y * y * (1 + 2 * x) * a.q[i] + x * x * (1 + 2 * y) * b.q[i] + h * x * y * (y * a.v[i] - x * b.v[i]);
      here_.v[i] = 6 * x * y * (b.q[i] - a.q[i]) / h + y * (1 - 3 * x) * a.v[i] + x * (1 - 3 * y) * b.v[i];
    }
    StateView s;
    s.t = t;
    s.q = here_.q.data();
    s.v = here_.v.data();
    s.z = x < 1 ? a.z.data() : b.z.data();
    return s;
  }
  std::size_t n_, nz_;
  TouchWatch touches_;
  State before_, after_, here_;
};
}  // namespace

double FixedRun::forward(const std::function<void(long k)>& at) {
  const Objective& objective = scheme_->objective();
  const bool running = scheme_->has_running_cost();
  double psi = 0;
  FixedTouches touches(scheme_->assembly(), objective, problem_.solver);
  for (long k = 0;; ++k) {
    const StateView here = scheme_->state();
    touches.step(here);
    k == 0 ? watch_->begin(here.t, here.q, here.v) : watch_->step(here.t, here.q, here.v);
    if (!formulas_.empty()) formulas_.look(here, scheme_->assembly());
    if (running) psi += weight(k) * objective.running_value(scheme_->state(), scheme_->assembly());
    if (at) at(k);
    if (problem_.monitor && k % kPoll == 0) problem_.monitor(scheme_->time(), k, false);
    if (k == steps_) break;
    if (!plan_->empty()) plan_->require(scheme_->time(), scheme_->state(), scheme_->coefficients().h);
    scheme_->step();
  }
  const StateView last = scheme_->state();
  watch_->finish(last.t, last.q, last.v);
  const DiscreteCounters& c = scheme_->counters();
  counters_.steps = c.steps;
  counters_.newton_iterations = c.newton_iterations;
  counters_.residuals = c.residuals;
  counters_.jacobians = scheme_->matrices().step_factorizations();
  return psi + objective.terminal_value(scheme_->state(), scheme_->assembly());
}

std::vector<double> FixedRun::backward(StepArchive& archive, DiscreteAdjoint& adjoint) {
  const DiscreteCounters before = scheme_->counters();
  const long jacobians_before = scheme_->matrices().step_factorizations();
  adjoint.clear();
  for (long k = steps_;; --k) {
    const bool factored = archive.bring_back(k);
    if (k == steps_) adjoint.add_terminal_cost();
    adjoint.add_running_cost(weight(k));
    if (problem_.monitor && k % kPoll == 0) problem_.monitor(scheme_->time(), steps_ - k, true);
    if (k == 0) {
      counters_.backward_steps = steps_;
      counters_.backward_residuals = scheme_->counters().residuals - before.residuals;
      counters_.backward_newton_iterations = scheme_->counters().newton_iterations - before.newton_iterations;
      counters_.backward_jacobians = scheme_->matrices().step_factorizations() - jacobians_before;
      counters_.checkpoints = archive.checkpoints();
      return adjoint.finish(factored);
    }
    adjoint.step_back(factored);
  }
}

void FixedRun::conclude(Simulation& result) const {
  for (const auto& text : watch_->warnings()) notice(text);
  if (const double drift = watch_->told_drift(); drift > 0) widen_error(result, drift * result.psi);
  require_finite(result);
}

void FixedRun::conclude(GradientResult& result) const {
  for (const auto& why : {watch_->without_derivative(), formulas_.met()})
    if (why) throw SolverError(*why);
  conclude(static_cast<Simulation&>(result));
  if (const double drift = watch_->told_drift(); drift > 0)
    widen_error(result, problem_.parameters, 0,
                drift * gradient_size(problem_.parameters, result.psi, result.gradient));
  require_finite(problem_, result);
}

Counters FixedRun::counters() const {
  Counters c = counters_;
  c.simulations = 1;
  c.factorizations = scheme_->matrices().step_factorizations() + scheme_->matrices().projection_factorizations();
  return c;
}

}  // namespace costate
