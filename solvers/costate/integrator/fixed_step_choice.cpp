// How many fixed steps a run takes whose step nobody has given, for psi and for its gradient.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>
#include <vector>

#include "costate/analysis/not_finite.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/integrator/bent_motion.h"
#include "costate/integrator/fixed_run.h"
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
  return problem.solver.absolute() * (cost ? kPart * cost_size(problem) : length_size(*problem.mechanism));
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
  // Of second order: of two runs the finer one's error is their difference by (n'/n)^2 - 1. Where forces bend or
  // contacts come and go within steps, errors of gradients are of no order: then it may be all of the difference.
  const bool rough = may_bend(problem);
  std::optional<GradientResult> other;
  double less = rough ? 1 : 3, error = HUGE_VAL;
  try {
    const Unsaid coarser;
    other = run(steps / 2);
    error = change(problem, *other, r) / less;
  } catch (const SolverError&) {  // too coarse
  }
  if (!(error <= kGradientError * wanted)) {
    // By whole doublings, so that a tangent and an adjoint that differ by rounding take the same steps.
    const double needed = std::isfinite(error) ? std::sqrt(2 * error / (kGradientError * wanted)) : 4;
    long times = 2;
    while (static_cast<double>(times) < needed && times < kMostRefined) times *= 2;
    const long finer = std::min(steps * times, problem.solver.max_steps);
    if (finer > steps) other = r;
    r = run(finer);
    const double ratio = static_cast<double>(finer) / static_cast<double>(steps);
    if (finer > steps) less = rough ? 1 : ratio * ratio - 1, error = change(problem, *other, r) / less;
  }
  // Of no order two may be as near each other by chance as twice that.
  if (other) {
    const double apart = rough ? 0.5 : less;
    std::vector<double> errors = pooled_changes(problem.parameters, r.gradient, other->gradient);
    for (double& e : errors) e /= apart;
    widen_error(r, (r.psi - other->psi) / apart, errors);
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

}  // namespace costate
