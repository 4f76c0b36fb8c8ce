#include "costate/integrator/run_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/formulation/solved_state.h"
#include "costate/integrator/event_notices.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/objective/cycle_output.h"
#include "costate/problem/known_error.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {
// Where a step has to be solved for its positions, every so many steps do, and the first ones: few steps are long.
constexpr long kSolvedCadence = 3, kFirstSteps = 200;

// What one error of the size of the tolerance may change psi by: in parts of psi or of its largest scaled derivative;
// in parts of psi alone, which may happen to be small; and in absolute tolerances, by which psi is known in any case.
constexpr double kFewDigits = 1e-2, kNoDigit = 1e3, kAbsolute = 1e3;
// What one such error may change psi by in parts of the gradient and of rtol. Measured where derivatives are small: a
// run's errors are some 5 to 20 such errors; on the models this is 1 to 60. And the smallest part of its tolerances,
// and tolerance, that a run is repeated with.
constexpr double kResolved = 200, kErrors = 20, kSmallestPart = 1e-4, kSmallestTolerance = 1e-13;
// What the adjoint may lose of its invariant without a word: on the models, from 1e-6 to 1e-2, within a factor of some
// four of what the gradient was off by.
constexpr double kInvariant = 3e-3;

// What quadratures add in absolute tolerances, a step, where psi is small beside these: 0.06 on a fast road whose
// places bound the steps, so that no error test does.
constexpr double kOfStep = 0.2, kUnresolvedPsi = 2e-3;
constexpr long kManySteps = 1000;

// Of what bounces leave out of psi that is said, in rtol of it.
constexpr double kUnseenSaid = 1e3;

// From this tolerance on a run of some steps may keep no digit: measured, motions are off by 0.3 to 0.8 of their range
// at 0.1, and by as much in some scenes at 0.01.
constexpr double kNoPromise = 1e-2;

thread_local double drift_of_last_run = 0;

WatchSettings settings_of(const Problem& problem) {
  WatchSettings s;
  s.rtol = problem.solver.rtol;
  s.objective = problem.objective;
  s.formulation = problem.formulation;
  const Formulation& f = find_formulation(problem.formulation);
  s.carries_redundancy = f.carries_redundancy;
  s.weighted = f.weighted;
  s.chosen_weight = f.softness_chosen && f.softness_chosen(problem.formulation_options);
  return s;
}
}  // namespace

RunWatch::RunWatch(const Problem& problem, const std::vector<double>& rho, System& system)
    : watch_(problem.mechanism, problem.parameters, rho.data(), settings_of(problem)),
      grazing_(*problem.mechanism),
      offsets_(*problem.mechanism),
      idle_(*problem.mechanism),
      formulas_(*problem.mechanism, problem.objective, FormulaJumpWatch::Looks::whole),
      own_jumps_(*problem.mechanism, problem.objective),
      system_(system),
      problem_(problem),
      open_costs_(problem, rho),
      stabilization_(StabilizationWatch::of(problem, rho, system)) {}

StepSink RunWatch::sink() {
  return [this](double t, const double* y) {
    look_at_contacts(t, y);
    if (open_costs_.follows()) open_costs_.look(system_.look_state(t, y));
    if (!formulas_.empty()) formulas_.look(solved_state(system_, t, y), system_.assembly());
    look_for_own_jumps(t, y);
    if (system_.begins_with_motion() || ++steps_ <= kFirstSteps || steps_ % kSolvedCadence == 0)
      look(&MotionWatch::step, t, y);
    sample(t, y);
  };
}

void RunWatch::look(void (MotionWatch::*what)(double, const double*, const double*), double t, const double* y) {
  if (system_.begins_with_motion()) return (watch_.*what)(t, y, y + system_.assembly().n());
  const MechanismState s = system_.look_state(t, y);
  (watch_.*what)(t, s.q, s.v);
}

void RunWatch::look_at_contacts(double t, const double* y) {
  if (grazing_.empty()) return;  // without a touch there is no contact
  const MechanismState s = system_.look_state(t, y);
  grazing_.look(s, system_.assembly());
  if (!offsets_.empty()) offsets_.look(s, system_.assembly());
  if (idle_.asks(s.z)) idle_.look(solved_state(system_, t, y), system_.assembly());
}

void RunWatch::look_for_own_jumps(double t, const double* y) {
  if (!own_jumps_.empty()) own_jumps_.look(solved_state(system_, t, y), system_.assembly());
}

/// A psi that is no number because it holds values of a cycle that nobody has looked for.
static void require_cycle(const Problem& problem, double psi) {
  if (!std::isnan(psi)) return;
  const std::vector<int> values = cycle_value_numbers(*problem.mechanism);
  for (const Parameter& p : problem.parameters.parameters)
    for (const auto& [number, factor] : p.bindings)
      if (!values.empty() && number == values.front()) return;
  if (!values.empty())
    throw CapabilityError(
        "The cost holds values of a limit cycle (cycle.period, cycle.speed, ...), which this run does not look for. "
        "'costate cycle' computes it, and 'gradient' and 'optimize' do where [run] has cycle = true.");
}

void RunWatch::tell_of_motion() const {
  for (const auto& text : watch_.warnings()) notice(text);
}

double cost_unseen(const std::vector<RunEvent>& events) {
  double sum = 0;
  for (const RunEvent& e : events) sum += e.cost_unseen;
  return sum;
}

double gradient_unseen(const std::vector<RunEvent>& events) {
  return cost_unseen(events) * static_cast<double>(2 + events.size());
}

void RunWatch::conclude(Simulation& result) const {
  drift_of_last_run = std::max(watch_.largest_drift(), watch_.largest_rate_drift());
  tell_of_motion();
  if (const double drift = watch_.told_drift(); drift > 0) widen_error(result, drift * result.psi);
  const double left =
      kOfStep * static_cast<double>(result.counters.steps) * problem_.solver.absolute() * cost_size(problem_);
  if (!problem_.objective.running.empty() && result.counters.steps > kManySteps &&
      left > kUnresolvedPsi * std::abs(result.psi) && left < std::abs(result.psi) &&
      problem_.solver.rtol * std::abs(result.psi) < problem_.solver.absolute() * cost_size(problem_))
    widen_error(result, left);
  if (const double unseen = cost_unseen(result.events); unseen > 0) {
    widen_error(result, unseen);
    if (unseen > kUnseenSaid * problem_.solver.rtol * std::abs(result.psi))
      notice(fmt::format(
          "psi holds a force that acts as bounces die out, and may be off by {:.2g}: they are too small to be seen "
          "before they end, and no tolerance makes them larger.",
          unseen));
  }
  if (const double part = tell_of_offset(offsets_, problem_.solver.rtol); part > 0) widen_by_what_stays(result, part);
  if (const std::string text = stabilization_ ? stabilization_->warning() : ""; !text.empty()) notice(text);
  if (problem_.solver.rtol >= kNoPromise)
    notice(fmt::format(
        "At rtol {:g} each of the {} steps may be off by that much: no digit of the motion or of psi is promised. A "
        "smaller rtol (1e-4) costs little more.",
        problem_.solver.rtol, result.counters.steps));
  tell_of_own_jumps(own_jumps_);
  tell_of_grazing(grazing_, system_.motion_events(), problem_.solver.rtol);
  open_costs_.tell(watch_.began_redundant());
  const std::vector<double> kinks = driver_kinks(*problem_.mechanism, system_.assembly().numbers());
  tell_of_end(problem_, result, kinks);
  tell_of_impulses(problem_, result, kinks);
  tell_of_samples(problem_, result.events);
  require_cycle(problem_, result.psi);
  require_finite(result);
}

void RunWatch::finish(double t, const double* y, bool at_event) {
  look(&MotionWatch::finish, t, y);
  // Where an event is the end it is known on which side of it the run ends.
  if (!at_event && !grazing_.empty() && !problem_.ends_when && !problem_.cycle &&
      std::isinf(problem_.solver.events_until))
    tell_of_impact_behind(problem_, system_.assembly(), system_.kinematic_state(t, y), grazing_);
}

void RunWatch::conclude(GradientResult& result) const {
  refuse_grazing(grazing_, problem_.solver.rtol);
  for (const auto& why : {watch_.without_derivative(), formulas_.met(), own_jumps_.met()})
    if (why) throw SolverError(*why);
  open_costs_.refuse_gradient(watch_.began_redundant());
  conclude(static_cast<Simulation&>(result));
  tell_of_start(problem_, result);
  tell_of_idle(idle_);
  tell_of_coincident(problem_, system_.assembly().numbers(), result.events);
  if (const double unseen = gradient_unseen(result.events); unseen > 0)
    widen_error(result, problem_.parameters, 0, unseen);
  widen_by_drift(result, problem_.parameters, watch_.told_drift());
  require_finite(problem_, result);
}

double last_drift() { return drift_of_last_run; }

double RunWatch::resolving_part(const GradientResult& result, const AdjointGrowth& growth, double asked) const {
  if (result.gradient.empty()) return 1;
  const double size = gradient_size(problem_.parameters, result.psi, result.gradient),
               allowed = kResolved * asked * size;
  if (!(size > 0) || !(growth.change() > allowed)) return 1;
  return std::max(allowed / growth.change(), std::max(kSmallestPart, std::min(1.0, kSmallestTolerance / asked)));
}

void tell_unresolved(const Problem& problem, GradientResult& result, double part) {
  const double size = gradient_size(problem.parameters, result.psi, result.gradient),
               known = std::min(1.0, kErrors * kResolved * problem.solver.rtol / part);
  widen_error(result, problem.parameters, 0, known * size);
  notice(fmt::format(
      "The gradient is small ({:.2g} in its largest scaled derivative, psi {:.6g}) against the adjoint that it is made "
      "of: at rtol {:g} it is known to some {:.0e} of its size. A smaller rtol, or a forward method, tells more.",
      size, result.psi, problem.solver.rtol, known));
}

void RunWatch::judge(GradientResult& result, const AdjointGrowth& growth, const AdjointInvariant& invariant) const {
  const double size = std::max(std::abs(result.psi), largest_scaled(problem_.parameters, result.gradient));
  // H is the derivative of psi by a shift in time: over the run's length it stands beside the scaled derivatives.
  const double lost = invariant.change() * (problem_.solver.t_end - problem_.solver.t_start);
  if (invariant.known() && lost > kInvariant * size && lost > kAbsolute * problem_.solver.absolute()) {
    widen_error(result, problem_.parameters, 0, lost);
    notice(fmt::format(
        "The adjoint's invariant (mu^T f + g) changed on the way back by as much as {:.1e} of the gradient: that is "
        "about "
        "what the gradient by this method is off by. Compare methods (costate check), or take a smaller rtol.",
        size > 0 ? lost / size : lost));
  }
  const double part = size > 0 ? growth.change() / size : 0;
  // A derivative that has grown together with the errors is no measure: psi is the one that has not.
  const double of_psi = result.psi != 0 ? growth.change() / std::abs(result.psi) : part;
  if ((part <= kFewDigits && of_psi <= 1) || growth.change() <= kAbsolute * problem_.solver.absolute()) return;
  const std::string text = fmt::format(
      "An error of the size of the tolerance (rtol {:g}) at t = {:.6g} s changes psi by {:.2g}, most by {}, where "
      "psi is {:.6g}",
      problem_.solver.rtol, growth.time(), growth.change(), growth.worst(), result.psi);
  // What makes much of an error is as a rule what the motion has just met.
  std::string behind;
  for (const RunEvent& e : result.events)
    if (e.t <= growth.time()) behind = fmt::format(" (its last event before is {} at {:.6g} s)", e.name, e.t);
  if (of_psi > kNoDigit)
    throw SolverError(
        text + behind +
        ": no digit of psi or of its gradient is known. The motion is chaotic or unstable over this time; "
        "shorten it, or take a smaller rtol where that helps.");
  widen_error(result, problem_.parameters, growth.change(), growth.change());
  notice(text + behind + ": psi and its gradient are known to few digits. A smaller rtol tells how many.");
}

void require_finite(const Simulation& result) {
  if (!std::isfinite(result.psi))
    throw SolverError(fmt::format("psi is {}: the cost is not finite along this motion.", result.psi));
}

void require_finite(const Problem& problem, const GradientResult& result) {
  require_cycle(problem, result.psi);
  require_finite(result);
  for (std::size_t j = 0; j < result.gradient.size(); ++j)
    if (!std::isfinite(result.gradient[j]))
      throw SolverError(
          fmt::format("The derivative of psi with respect to '{}' is {}; psi itself is {:.6g}. Another method or "
                      "formulation may get there, see 'costate check'.",
                      problem.parameters.parameters[j].name, result.gradient[j], result.psi));
}

}  // namespace costate
