#include "costate/integrator/event_notices.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/element/force/rigid_contact.h"
#include "costate/element/unilateral_force.h"
#include "costate/event/named_event.h"
#include "costate/level/fixed_times.h"
#include "costate/mechanism/coordinate_parts.h"
#include "costate/objective/sampled_cost.h"
#include "costate/scene/wanted_part.h"

namespace costate {

namespace {
// Of the run: an event so near its end, its start, or another one is there.
constexpr double kSameInstant = 1e-9;
// In tolerances of what the gap ranges over: a touch of this depth, or missed by as much, may come or not, as runs'
// errors are up to some hundred tolerances.
constexpr double kHair = 100;
// In rtol: what the offset of slips may leave in results without a word.
constexpr double kOffsetSaid = 100;

/// Whether a running cost holds what moves with a force's coordinates, through any of the mechanism.
bool holds_part(const Mechanism& m, const std::shared_ptr<const CostTerm>& term, const std::vector<int>& parts,
                int part) {
  Objective one;
  one.running.push_back(term);
  const std::optional<std::vector<int>> of = coordinates_of(m, one);
  return !of || std::any_of(of->begin(), of->end(), [&](int c) { return parts[static_cast<std::size_t>(c)] == part; });
}

/// Of events of two parts that have nothing to do with each other but that a running cost holds both: which of them
/// comes first decides what the cost is between them.
std::string kink_by_cost(const Problem& problem, const std::string& first, const std::string& second) {
  const Mechanism& m = *problem.mechanism;
  const std::vector<int> parts = coordinate_parts(m);
  const auto part_of = [&](const std::string& event) {
    return parts[static_cast<std::size_t>(find_event(m, event).force->coordinates().front())];
  };
  const int a = part_of(first), b = part_of(second);
  if (a == b) return {};
  for (const auto& term : problem.objective.running) {
    if (holds_part(m, term, parts, a) && holds_part(m, term, parts, b))
      return fmt::format(
          "'{}' and '{}' happen in one instant, and a running cost holds what both of them move: where it "
          "is more than a sum of both, psi has another slope on either side, as one or the other comes "
          "first, and derivatives are those of one side. The method 'differences' tells",
          first, second);
  }
  return {};
}

/// Of a gradient: an event at a time at which a law of time jumps, as far as the run's errors tell.
void tell_of_jumps(const std::vector<double>& jumps, const std::vector<RunEvent>& events, double t_start,
                   double instant) {
  for (const RunEvent& e : events)
    for (const double t : jumps)
      if (std::abs(e.t - t) < instant && std::abs(t - t_start) > instant) {
        notice(fmt::format(
            "'{}' happens at t = {:.9g} s, where a law of time has a kink or a jump: psi has another slope as the one "
            "or the other comes first, and derivatives are those of one side, which another method may not take. Move "
            "one of them; the method 'differences' tells.",
            e.name, t));
        return;
      }
}

/// What there is to say of the touch that is most nearly missed, if errors may decide whether it comes: how many
/// tolerances deep it is, and a sentence.
std::optional<std::pair<double, std::string>> grazed_touch(const GrazingWatch& watch, double rtol) {
  const std::optional<GrazingWatch::Place> at = watch.nearest();
  if (!at) return {};
  const double tolerances = at->depth / (rtol * at->range);
  if (tolerances > kHair) return {};
  return std::pair{tolerances, fmt::format("'{}' is grazed: near t = {:.9g} s its gap would turn round within {:.2g} m "
                                           "of zero, {:.1e} of what it ranges over, and errors of that size decide "
                                           "whether it comes (rtol {:g})",
                                           at->event, at->t, at->depth, at->depth / at->range, rtol)};
}

/// Of a touch that is let pass, or not, as it comes a hair above or below the ground to where it may touch: a sentence.
std::optional<std::string> touch_let_pass(const MotionEvents& events, double rtol) {
  const std::optional<MotionEvents::Pass>& at = events.nearest_pass();
  if (!at || std::abs(at->gap) > kHair * rtol * at->size) return {};
  return fmt::format(
      "'{}' comes to where it may be, or is not any more, at t = {:.9g} s, {:.2g} m from zero: errors of "
      "that size decide whether it comes, or is let pass (rtol {:g})",
      at->event, at->t, std::abs(at->gap), rtol);
}
}  // namespace

void tell_of_grazing(const GrazingWatch& watch, const MotionEvents* events, double rtol) {
  const char* what = ". Move the motion away from there, or take a smaller rtol.";
  if (const auto g = grazed_touch(watch, rtol)) notice(g->second + what);
  if (const auto text = events ? touch_let_pass(*events, rtol) : std::nullopt) notice(*text + what);
}

void refuse_grazing(const GrazingWatch& watch, double rtol) {
  if (const auto g = grazed_touch(watch, rtol); g && g->first < 1)
    throw SolverError(g->second +
                      ". A gradient does not exist where a touch is grazed. Move the motion away from there, or take a "
                      "smaller rtol.");
}

double tell_of_offset(const SlipOffsetWatch& watch, double rtol) {
  const std::optional<SlipOffsetWatch::Slip> slip = watch.slowest();
  if (!slip || slip->part() <= kOffsetSaid * rtol) return 0;
  const double part = std::min(1.0, slip->part());
  notice(fmt::format(
      "{} begins to slide from rest at t = {:.6g} s with an offset of {:g} m/s, turns, and gets no faster than {:.2g} "
      "m/s: what depends on this slip may be off by {:.0e} of itself, whatever the tolerance.",
      slip->contact, slip->t, kSlidingOffset, slip->fastest, part));
  return part;
}

void tell_of_idle(const IdleContactWatch& watch) {
  if (!watch.first()) return;
  notice(fmt::format(
      "{} is closed from t = {:.6g} s to {:.6g} s and bears nothing: what pushes away from it opens it, and what "
      "pushes towards it does not move, so that psi may have another slope on either side. Derivatives are those of a "
      "contact that holds; the method 'differences' tells both.",
      watch.first()->contact, watch.first()->from, watch.first()->to));
}

void tell_of_own_jumps(const OwnJumpWatch& watch) {
  if (watch.needs_impulse()) notice(*watch.met() + " Velocities jump there, for which this run has no impulse.");
}

void tell_of_end(const Problem& problem, const Simulation& result, const std::vector<double>& kinks) {
  if (problem.objective.terminal.empty()) return;
  const SolverOptions& run = problem.solver;
  const double end = result.end ? result.end->t : run.t_end, instant = kSameInstant * (end - run.t_start);
  const char* what =
      "where the run ends: terminal costs are those behind it, and rounding decides whether it belongs to the run. "
      "Move ";
  if (!result.events.empty() && !result.end && end - result.events.back().t < instant)
    notice(fmt::format("'{}' happens at t = {:.9g} s, {}t_end_s.", result.events.back().name, result.events.back().t,
                       what));
  for (const double kink : kinks)
    if (std::abs(kink - end) < instant)
      notice(
          fmt::format("The law of a driver has a kink at t = {:.9g} s, where velocities jump, {}the end.", kink, what));
}

void tell_of_impulses(const Problem& problem, const Simulation& result, const std::vector<double>& kinks) {
  if (!problem.objective.running_needs_accelerations()) return;
  const Mechanism& m = *problem.mechanism;
  const double begin = problem.solver.t_start, end = result.end ? result.end->t : problem.solver.t_end;
  const auto kink = std::find_if(kinks.begin(), kinks.end(), [&](double t) { return begin < t && t < end; });
  const std::vector<int> parts = constrained_parts(m);  // forces carry no impulse
  for (const auto& term : problem.objective.running) {
    if (!term->needs_accelerations()) continue;
    const auto* output = dynamic_cast<const OutputTerm*>(term.get());
    const std::string of = output ? "'" + output->output().name() + "'" : "accelerations or reactions";
    const auto tell = [&](double t, const std::string& what) {
      notice(
          fmt::format("Velocities jump at t = {:.9g} s ({}), and what makes them jump is an impulse: the integral of "
                      "{} in the cost, and its gradient, are without it, as without its work.",
                      t, what, of));
    };
    if (kink != kinks.end()) return tell(*kink, "the law of a driver has a kink");
    for (const RunEvent& e : result.events) {
      const Force* force = e.jump == 0 ? nullptr : find_event(m, e.name).force;
      if (force && dynamic_cast<const UnilateralForce*>(force) &&
          holds_part(m, term, parts, parts[static_cast<std::size_t>(force->coordinates().front())]))
        return tell(e.t, e.name);
    }
  }
}

void tell_of_impact_behind(const Problem& problem, const Assembly& assembly, const StateView& end,
                           GrazingWatch& watch) {
  if (problem.objective.terminal.empty()) return;
  const double instant = kSameInstant * (end.t - problem.solver.t_start);
  if (const auto impact = watch.impact_within(instant, end, assembly))
    notice(fmt::format(
        "'{}' happens within {:.1g} s behind the end of the run, t = {:.9g} s, where velocities jump: rounding decides "
        "whether it belongs to the run. Move the end.",
        *impact, instant, end.t));
}

void tell_of_samples(const Problem& problem, const std::vector<RunEvent>& events) {
  const SampleTerm* samples = sample_term(problem.objective);
  if (!samples) return;
  const double instant =
      std::max(kSameInstant, kTimesOff * problem.solver.rtol) * (problem.solver.t_end - problem.solver.t_start);
  // What only begins to press moves what depends on accelerations alone.
  const auto jumps = [&](const RunEvent& e) {
    return samples->needs_accelerations() ||
           (e.jump != 0 && dynamic_cast<const UnilateralForce*>(find_event(*problem.mechanism, e.name).force));
  };
  for (const RunEvent& e : events)
    for (const double t : samples->times())
      if (std::abs(e.t - t) < instant && jumps(e)) {
        notice(fmt::format(
            "'{}' happens at t = {:.9g} s, where a sample of the cost is: errors decide whether the sample is before "
            "the event or behind it, and derivatives are those of one side. Leave it out, or move its time.",
            e.name, t));
        return;
      }
}

void tell_of_start(const Problem& problem, const Simulation& result) {
  const SolverOptions& run = problem.solver;
  if (problem.cycle || result.events.empty() ||
      !(result.events.front().t - run.t_start < kSameInstant * (run.t_end - run.t_start)))
    return;
  notice(
      fmt::format("'{}' happens at t = {:.9g} s, where the run starts: derivatives by what moves the start or the "
                  "event are those "
                  "on the side on which it comes, and psi may jump to the other one. Begin before it, or behind it.",
                  result.events.front().name, result.events.front().t));
}

void tell_of_coincident(const Problem& problem, const std::vector<double>& numbers,
                        const std::vector<RunEvent>& events) {
  const double instant = kSameInstant * (problem.solver.t_end - problem.solver.t_start);
  if (!events.empty())
    tell_of_jumps(
        jump_times(*problem.mechanism, problem.objective, numbers), events, problem.solver.t_start,
        std::max(kSameInstant, kTimesOff * problem.solver.rtol) * (problem.solver.t_end - problem.solver.t_start));
  for (std::size_t k = 1; k < events.size(); ++k)
    for (std::size_t i = k; i-- > 0 && events[k].t - events[i].t < instant;)
      for (const std::string& kink : {kink_of_coincident(*problem.mechanism, events[i].name, events[k].name),
                                      kink_by_cost(problem, events[i].name, events[k].name)})
        if (!kink.empty()) {
          notice(fmt::format("At t = {:.9g} s {}.", events[k].t, kink));
          return;
        }
}

}  // namespace costate
