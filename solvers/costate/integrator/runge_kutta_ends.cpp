// Where a step of a Runge-Kutta scheme ends at an event, or at a touch that is none, and what follows it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/formulation/solved_state.h"
#include "costate/integrator/runge_kutta_run.h"

namespace costate {

namespace {
// A mechanism that changes its segment this often without getting on is stuck.
constexpr std::size_t kMostJumpsAtOnce = 1000;
// The step that ends at an event: of the step that went past it the part over which its dense output tells the guard's
// rate, and how often the length is corrected by that.
constexpr double kAside = 1e-3;
constexpr int kCorrections = 8;
// Of the way to an event whose step has no solution.
constexpr double kTowards = 0.25;
}  // namespace

template <class Kind>
bool RungeKuttaRun<Kind>::end_step_at_event(double t) {
  try {
    end_step_at(begin_, t,
                [&](double at, const double* y) { return system_.pending_guard(solved_state(system_, at, y)); });
  } catch (const StepError& e) {  // where forces turn as fast as slow slips: nearer to it they hardly turn any more
    last_step_error_ = e.what();
    ++failed_;
    system_.forget_event();
    end_time_ = begin_;
    std::copy(step_->start(), step_->start() + step_->size(), end_.begin());
    return false;
  }
  stand_at_end();
  return true;
}

template <class Kind>
std::optional<double> RungeKuttaRun<Kind>::step_towards(double event) {
  const double part = kTowards * (event - begin_);
  find_step(part, begin_ + part);
  stand_at_end();
  return event_within();
}

template <class Kind>
void RungeKuttaRun<Kind>::end_step_at(double begin, double t, const std::function<double(double, const double*)>& guard,
                                      double near) {
  const double whole = step_->h();
  double h = std::max(0.0, t - begin), end = t, moved = whole;
  const auto guard_within = [&](double length) {
    step_->dense(length / whole, y_.data());
    return guard(begin + length, y_.data());
  };
  // The guard's rate, by which the length is corrected: the dense output is smooth on either side of the event.
  const double aside = h < 0.5 * whole ? kAside * whole : -kAside * whole;
  const double rate = whole > 0 ? (guard_within(h + aside) - guard_within(h)) / aside : 0;
  const auto end_at = [&](double length) {
    h = length;
    // An implicit step has a length.
    if constexpr (Kind::implicit)
      h = std::max(h, 4 * std::numeric_limits<double>::epsilon() * std::max(std::abs(begin), whole));
    end = begin + h;
    step_->attempt(h, end);
    return guard(end, step_->end());
  };
  double value = end_at(h);
  for (int k = 0; k < kCorrections && h > 0; ++k) {
    const double change = -value / rate;
    // To rounding, or as far as it gets on.
    if (!(std::abs(change) < 0.5 * moved) || !(end + change != end)) break;
    if (std::abs(change) < near * whole) return;
    moved = std::abs(change);
    value = end_at(std::max(0.0, h + change));
  }
  // Its far side: a force that begins there has begun, with its derivatives.
  double further = std::numeric_limits<double>::epsilon() * std::max(std::abs(end), h);
  for (int k = 0; k < kCorrections && h > 0 && !(value * rate > 0); ++k, further *= 2) value = end_at(h + further);
}

template <class Kind>
void RungeKuttaRun<Kind>::cross() {
  Jump jump;
  jump.t = end_time_;
  jump.event = system_.pending_event();
  jump.before = system_.mode();
  jump.y.assign(end_.begin(), end_.begin() + system_.size());
  std::vector<double> y = end_;
  const double t_after = system_.segment_start(end_time_);
  if constexpr (Kind::implicit) {
    jump.yp.assign(jump.y.size(), 0);
    step_->end_rates(jump.yp.data());
    std::vector<double> yp = jump.yp;
    system_.jump(end_time_, y.data(), yp.data());
  } else {
    system_.jump(end_time_, y.data());
  }
  jump.after = system_.mode();
  if (jump.event < 0) system_.require_contacts_follow(jump, t_after, y.data());
  system_.forget_event();
  jumps_in_a_row_ = end_time_ > segment_start_ ? 0 : jumps_in_a_row_ + 1;
  if (jumps_in_a_row_ > kMostJumpsAtOnce)
    throw SolverError(fmt::format("The run does not get beyond t = {:.9g} s: one segment follows another.", jump.t));
  if (jump.event >= 0) {
    events_.push_back({jump.t, system_.event_name(jump.event), system_.event_mode(jump.event), system_.event_jump(),
                       system_.event_loss(), system_.cost_of_unseen_bounces(t_after, y.data())});
    chatter_.look(events_, options_.t_end);
  }
  ++jumps_;
  if (follower_.jump) follower_.jump(jump);
  if (tape_) tape_->add_jump(jump, {y.begin(), y.begin() + system_.size()});
  begin_segment(t_after, y);
}

template bool RungeKuttaRun<ExplicitKind>::end_step_at_event(double);
template bool RungeKuttaRun<RadauKind>::end_step_at_event(double);
template std::optional<double> RungeKuttaRun<ExplicitKind>::step_towards(double);
template std::optional<double> RungeKuttaRun<RadauKind>::step_towards(double);
template void RungeKuttaRun<ExplicitKind>::end_step_at(double, double,
                                                       const std::function<double(double, const double*)>&, double);
template void RungeKuttaRun<RadauKind>::end_step_at(double, double, const std::function<double(double, const double*)>&,
                                                    double);
template void RungeKuttaRun<ExplicitKind>::cross();
template void RungeKuttaRun<RadauKind>::cross();

}  // namespace costate
