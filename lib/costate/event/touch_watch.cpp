#include "costate/event/touch_watch.h"

#include <algorithm>
#include <cmath>

#include "costate/element/guarded_force.h"
#include "costate/element/unilateral_force.h"

namespace costate {

namespace {
// A dip is passed over where it is deeper by this than where the step begins or ends within it: six tenths of a
// parabola's width, eight tenths of it with one of its ends, or more.
constexpr double kDeeper = 1.5;
// Steps over such a dip, and on the way back over any touch.
constexpr double kSteps = 8, kStepsBack = 4;
// Steps that end at a touch do so behind this part of them: what has just been crossed is behind.
constexpr double kBehindTouch = 1e-6;
// Of the integrator's tolerances: the depth from which on a dip counts.
constexpr double kCounts = 0.1;
// A force that is cut off, or not, at both ends of a step is followed within it where it is less than this part of the
// largest so far at one of them: from so many looks, and to such a part of the step.
constexpr double kNearlyNone = 0.05, kNearTurn = 1e-3;
constexpr int kForceLooks = 4;
}  // namespace

TouchWatch::TouchWatch(Assembly& assembly, const Objective& objective, double rtol, double atol, double span,
                       LeftBends leaves)
    : assembly_(assembly), rtol_(rtol), atol_(atol), paths_(assembly, objective, rtol, atol, leaves, span) {
  const Mechanism& m = assembly.mechanism();
  for (std::size_t f = 0; f < m.forces().size(); ++f) {
    const Force& force = *m.forces()[f];
    add_stops(force, m.state_offsets()[f]);
    const auto* gaps = dynamic_cast<const GapElement*>(&force);
    // Impacts are events.
    if (!gaps || dynamic_cast<const UnilateralForce*>(&force)) continue;
    const auto* guarded = dynamic_cast<const GuardedForce*>(&force);
    for (int i = 0; i < gaps->gap_count(); ++i) {
      bool is_event = false;
      for (int k = 0; guarded && k < guarded->guard_count(); ++k) is_event = is_event || gaps->gap_of_guard(k) == i;
      add(force, m.state_offsets()[f], GapTrace(force, *gaps, i), is_event);
    }
  }
}

void TouchWatch::add_stops(const Force& force, int first_state) {
  const auto* owner = dynamic_cast<const MotionLawElement*>(&force);
  if (!owner) return;
  std::vector<MotionLaw> laws;
  owner->add_motion_laws(laws);
  std::vector<double> p;
  for (const int n : force.numbers()) p.push_back(assembly_.numbers()[static_cast<std::size_t>(n)]);
  for (const MotionLaw& of : laws) {
    if (of.origin < 0) continue;
    for (const LawBegin& begin : law_begins(*of.law, p.data() + of.first))
      add(force, first_state, GapTrace(force, *owner, of.origin, begin));
  }
}

void TouchWatch::add(const Force& force, int first_state, GapTrace trace, bool is_event) {
  gaps_.push_back({.trace = std::move(trace), .first_state = first_state, .rest = {}, .is_event = is_event});
  if (force.may_rest()) gaps_.back().rest.emplace(force, first_state);
}

bool TouchWatch::may_touch(double from, double to, const GapTrace::States& at) const {
  const StateView last = at(to);
  return std::any_of(gaps_.begin(), gaps_.end(), [&](const Gap& g) {
    AtRest end_of_rest;
    if (!g.trace.presses(last.z + g.first_state) || rests(g, from, last, end_of_rest)) return false;
    const auto end = g.trace.look(last, assembly_);
    // What has not been looked at yet may.
    return g.seen.t != from || end.m.gap < 0 || !stays_away(g.seen, end);
  });
}

bool TouchWatch::rests(const Gap& g, double from, const StateView& last, AtRest& end) {
  if (g.at_rest.t != from || !g.rest->holds(last.q, last.z)) return false;
  end = {last.t, g.rest->way(last.q), g.rest->speed(last.v)};
  const double distance = g.rest->distance(), speed = std::max(g.at_rest.speed, end.speed);
  return is_out_of_reach(2 * distance - g.at_rest.way - end.way, speed * (last.t - from), g.at_rest.way + end.way);
}

void TouchWatch::look_for_rest(Gap& g, const StateView& last) {
  const auto find = [&] {
    LocalState local = gathered_.of(g.trace.element(), last, assembly_.numbers());
    local.z = last.z + g.first_state;
    return g.rest->find(local);
  };
  g.at_rest = {};
  if (!g.rest || !std::isnan(g.touches_from)) return;
  if (!g.rest->holds(last.q, last.z) && !(g.rest->is_due() && find())) return;
  g.at_rest = {last.t, g.rest->way(last.q), g.rest->speed(last.v)};
}

std::optional<TouchLook> TouchWatch::look(double from, double to, const GapTrace::States& at) {
  if (!(from < to)) return {};
  const auto first = look_for_touches(from, to, at);
  if (const double until = first ? first->from : to; bends_ && from < until) bends_->add_step(from, until, at);
  return first;
}

std::optional<TouchLook> TouchWatch::look_for_touches(double from, double to, const GapTrace::States& at) {
  std::optional<TouchLook> first = paths_.look(from, to, at);
  if (gaps_.empty()) return first;
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  const StateView last = at(to);
  // Most steps end here where there are contacts out of reach.
  bool all_rest = true;
  for (Gap& g : gaps_) {
    AtRest end;
    g.rested = rests(g, from, last, end) || (std::isnan(g.touches_from) && !g.trace.presses(last.z + g.first_state));
    g.at_rest = end;
    if (g.rested)
      g.seen.t = none;
    else
      all_rest = false;
  }
  if (all_rest) return first;
  ends_.assign(gaps_.size(), {none, {}});
  traces_.resize(gaps_.size());
  bool near = false, passes_force = false;
  for (std::size_t i = 0; i < gaps_.size(); ++i) {
    Gap& g = gaps_[i];
    if (g.rested) continue;
    if (!g.trace.presses(last.z + g.first_state)) {
      // Behind an event.
      if (!std::isnan(g.touches_from)) touched_.emplace_back(g.touches_from, from);
      g.seen.t = g.touches_from = none;
      continue;
    }
    look_for_rest(g, last);
    for (const int c : g.trace.element().coordinates()) size_ = std::max(size_, std::abs(last.q[c]));
    ends_[i] = g.trace.look(last, assembly_);
    near = near || g.seen.t != from || !stays_away(g.seen, ends_[i]);
    if (const auto passed = force_passed_over(g, from, ends_[i], at);
        passed && (!first || passed->from < first->from)) {
      first = passed;
      passes_force = true;
    }
  }
  if (passes_force) {
    ++cuts_;
    touched_.emplace_back(first->from, first->to);
  }
  if (!near && first) return first;
  if (!near) {
    for (std::size_t i = 0; i < gaps_.size(); ++i)
      if (!std::isnan(ends_[i].t)) gaps_[i].see(ends_[i]);
    return first;
  }
  bool cut = false;
  for (std::size_t i = 0; i < gaps_.size(); ++i) {
    Gap& g = gaps_[i];
    if (std::isnan(ends_[i].t)) continue;
    if (g.seen.t != from) {
      g.seen = g.trace.look(at(from), assembly_);
      g.force = std::numeric_limits<double>::quiet_NaN();
    }
    traces_[i].clear();
    if (stays_away(g.seen, ends_[i])) continue;
    g.trace.follow(g.seen, ends_[i], at, assembly_, traces_[i]);
    const auto dip = dip_passed_over(g, traces_[i], at);
    // Of one and the same touch its gap tells more exactly.
    const bool same = dip && first && !cut && dip->element == first->element && dip->from < first->to;
    if (dip && (!first || same || dip->from < first->from)) {
      first = dip;
      cut = true;
    }
  }
  if (ends_steps_)
    if (const auto crossed = first_crossed(from, to, at); crossed && (!first || crossed->from < first->from)) {
      first = crossed;
      cut = false;
    }
  const double until = first ? first->from : to;
  for (std::size_t i = 0; i < gaps_.size(); ++i) {
    Gap& g = gaps_[i];
    if (std::isnan(ends_[i].t)) continue;
    if (g.seen.m.gap < 0 && std::isnan(g.touches_from)) g.touches_from = from;
    record(g, traces_[i], until, at);
    if (!first) g.see(ends_[i]);
  }
  if (cut) ++cuts_;
  return first;
}

std::optional<TouchLook> TouchWatch::dip_passed_over(const Gap& gap, const Looks& trace,
                                                     const GapTrace::States& at) const {
  const auto depth = [&](std::size_t k) { return std::max(0.0, -trace[k].m.gap); };
  const std::size_t last = trace.size() - 1;
  for (std::size_t k = 0; k <= last; ++k) {
    if (!(depth(k) > 0)) continue;
    const std::size_t begin = k;
    double deepest = 0;
    for (; k <= last && depth(k) > 0; ++k) deepest = std::max(deepest, depth(k));
    const std::size_t end = k;  // the first look behind it
    // At its end the force may be over already, so that the integrator has seen nothing of it.
    const bool over = end > last && begin > 0 && !(gap.force_at(at(trace[last].t), assembly_) > 0);
    const double at_ends = std::max(begin == 0 ? depth(0) : 0, end > last && !over ? depth(last) : 0);
    if (!(deepest > kDeeper * at_ends) || !(deepest > kCounts * (atol_ + rtol_ * size_))) continue;
    const double t1 = begin == 0 ? trace[0].t : gap.trace.zero(trace[begin - 1], trace[begin], at, assembly_);
    const double t2 = end > last ? trace[last].t : trace[end].t;
    return TouchLook{t1, t2, (t2 - t1) / kSteps, &gap.trace.element()};
  }
  return {};
}

std::optional<TouchLook> TouchWatch::force_passed_over(Gap& g, double from, const GapTrace::Look& end,
                                                       const GapTrace::States& at) {
  // What does not touch presses with nothing.
  const auto force = [&](double t) {
    const StateView s = at(t);
    const bool presses = g.trace.look(s, assembly_).m.gap < 0 && g.trace.presses(s.z + g.first_state);
    return presses ? g.force_at(s, assembly_) : -0.0;
  };
  const double to = end.t, before = g.seen.t == from ? g.force : std::nan("");
  const double behind = g.force_at_end = end.m.gap < 0 ? g.force_at(at(to), assembly_) : -0.0;
  g.largest = std::max(g.largest, std::abs(behind));
  if (std::isnan(before) || (before > 0) != (behind > 0)) return {};
  if (!(g.seen.m.gap < 0) && !(end.m.gap < 0)) return {};  // a dip, or none
  if (std::min(std::abs(before), std::abs(behind)) > kNearlyNone * g.largest) return {};
  // The look that is nearest to the other side, or on it.
  const double sign = before > 0 ? -1 : 1, part = (to - from) / (kForceLooks + 1);
  double left = from, best = from, most = sign * before;
  for (int k = 1; k <= kForceLooks; ++k)
    if (const double f = sign * force(from + k * part); f > most) {
      most = f;
      best = from + k * part;
    }
  if (sign * behind > most) return {};
  double right = std::min(to, best + part);
  left = std::max(from, best - part);
  constexpr double golden = 0.381966;
  for (int k = 0; !(most > 0) && right - left > kNearTurn * (to - from); ++k) {
    const bool ahead = right - best > best - left;
    const double t = ahead ? best + golden * (right - best) : best - golden * (best - left), f = sign * force(t);
    if (f > most) {
      (ahead ? left : right) = best;
      best = t;
      most = f;
    } else {
      (ahead ? right : left) = t;
    }
  }
  if (!(most > kCounts * rtol_ * g.largest)) return {};
  const auto change = [&](double here, double there) {  // `there` is on the other side
    for (int k = 0; k < 12; ++k) {
      const double middle = 0.5 * (here + there);
      (sign * force(middle) > 0 ? there : here) = middle;
    }
    return here;
  };
  const double t1 = change(from, best), t2 = change(to, best);
  return TouchLook{t1, t2, (t2 - t1) / kSteps, &g.trace.element()};
}

std::optional<TouchLook> TouchWatch::first_crossed(double from, double to, const GapTrace::States& at) const {
  std::optional<TouchLook> first;
  for (std::size_t i = 0; i < gaps_.size(); ++i) {
    const Gap& g = gaps_[i];
    const Looks& trace = traces_[i];
    if (g.is_event || std::isnan(ends_[i].t)) continue;
    for (std::size_t k = 1; k < trace.size(); ++k) {
      if ((trace[k - 1].m.gap < 0) == (trace[k].m.gap < 0)) continue;
      const double t = g.trace.zero(trace[k - 1], trace[k], at, assembly_);
      if (!(t > from + kBehindTouch * (to - from))) continue;
      if (!first || t < first->from) first = TouchLook{.from = t, .to = t, .crossed = &g.trace};
      break;
    }
  }
  return first;
}

void TouchWatch::record(Gap& gap, const Looks& trace, double until, const GapTrace::States& at) {
  for (std::size_t k = 1; k < trace.size() && trace[k - 1].t < until; ++k) {
    const GapTrace::Look &a = trace[k - 1], &b = trace[k];
    if ((a.m.gap < 0) == (b.m.gap < 0)) continue;
    const double t = gap.trace.zero(a, b, at, assembly_);
    if (t >= until) return;
    if (b.m.gap < 0) {
      gap.touches_from = t;
    } else if (!std::isnan(gap.touches_from)) {
      touched_.emplace_back(gap.touches_from, t);
      gap.touches_from = std::numeric_limits<double>::quiet_NaN();
    }
  }
}

std::vector<TouchLook> TouchWatch::touches(double t_end) const {
  std::vector<TouchLook> looks;
  const auto add = [&](double from, double to) {
    if (from < to) looks.push_back({from, to, (to - from) / kStepsBack});
  };
  for (const auto& [from, to] : touched_) add(from, to);
  for (const Gap& g : gaps_)
    if (!std::isnan(g.touches_from)) add(g.touches_from, t_end);
  paths_.add_looks(looks);
  return looks;
}

}  // namespace costate
