// The steps of a fixed-step run that are cut: where, and what is known there.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/integrator/fixed_run.h"
#include "costate/integrator/run_end.h"

namespace costate {

namespace {
// Of the grid's steps. What is so near one of the grid's times is met by the step to it or from it: steps divide by the
// square of their length, and shorter ones lose digits of derivatives. Behind a cut less than the other is an instant,
// over which rates are constant.
constexpr double kNearGrid = 1e-7, kInstantPart = 1e-9;
// The step that ends at a cut: of the step that went past it the part over which its course tells the rate of what is
// to be zero; how often its length is corrected; what of the grid's steps a correction is that still tells the rate;
// and what may be left.
constexpr double kAsidePart = 1e-3;
constexpr int kLengths = 12;
constexpr double kTellsRate = 1e-7, kMet = 1e-9;
// Laws know their places but for rounding. Of a law with more of them, in parts of the steps, steps end at those alone
// that parameters move, and at kinks of drivers.
constexpr double kBesidePlaces = 16, kMostPlaces = 4;
// A mechanism that changes this often without getting on is stuck.
constexpr std::size_t kMostCutsAtOnce = 1000;
}  // namespace

void FixedRun::find_places() {
  const SolverOptions& o = problem_.solver;
  const std::vector<double>& numbers = scheme_->assembly().numbers();
  beside_ = kBesidePlaces * std::numeric_limits<double>::epsilon() * (std::abs(o.t_start) + std::abs(o.t_end));
  const auto keep = [&](const std::vector<double>& times) {
    places_.clear();
    for (const double t : times)
      if (o.t_start + 2 * beside_ < t && t < o.t_end - 2 * beside_ && (places_.empty() || t > places_.back() + beside_))
        places_.push_back(t);
  };
  std::vector<double> times = jump_times(*problem_.mechanism, problem_.objective, numbers);
  for (const MovingInstant& m : moving_) times.push_back(m.t);
  std::sort(times.begin(), times.end());
  keep(times);
  if (static_cast<double>(places_.size()) > kMostPlaces * static_cast<double>(steps_)) keep(scheme_->kinks());
}

void FixedRun::take_step() {
  const double t = scheme_->time(), h0 = scheme_->regular_length();
  if (!cuts_possible_) {
    if (!plan_->empty()) plan_->require(t, scheme_->state(), h0);
    scheme_->step(h0, grid_time(scheme_->index() + 1));
    return;
  }
  if (scheme_->index() >= problem_.solver.max_steps)
    throw SolverError(
        fmt::format("At t = {:.9g} s the run has taken {} steps, which is their limit: events cut them. Choose larger "
                    "steps (--step, run.step_s), or a shorter run.",
                    t, scheme_->index()));
  while (grid_ < steps_ && !(grid_time(grid_ + 1) > t)) ++grid_;
  long next = std::min(grid_ + 1, steps_);
  while (next < steps_ && grid_time(next) - t < kNearGrid * h0) ++next;
  double stop = grid_time(next);
  if (!(stop - t > kInstantPart * h0)) {
    // A cut in the instant of the end.
    if (differentiates())
      throw SolverError(fmt::format(
          "'{}' happens at t = {:.9g} s, in the instant in which the run ends: the derivative is another one on either "
          "side. Let the run end a little earlier or later.",
          cuts_.empty() ? std::string("An event") : cuts_.back().name, t));
    finished_ = true;
    return;
  }
  const auto place = std::upper_bound(places_.begin(), places_.end(), t);
  const bool to_kink = place != places_.end() && *place <= stop + kNearGrid * h0;
  if (to_kink) stop = (place_ = *place) - beside_;
  const bool regular = !to_kink && next == grid_ + 1 && t == grid_time(grid_);
  const double h = regular ? h0 : std::max(0.0, stop - t);
  if (!plan_->empty()) plan_->require(t, scheme_->state(), h);
  StepCut at_kink;
  at_kink.kind = StepCut::Kind::kink;
  at_kink.name = "A kink or jump of a law";
  if (h <= kInstantPart * h0) {
    at_kink.instant = true;
    scheme_->move_on(h, stop);
    found_ = std::move(at_kink);
    return;
  }
  scheme_->step(h, stop);
  course_->take_step();
  const double until = to_kink || next == steps_ ? stop : stop + kNearGrid * h0;
  look_for_event(until);
  if (!found_ && scheme_->only_looks()) {
    scheme_->repeat(h, stop);
    course_->take_step();
  }
  look_for_end(found_ ? scheme_->time() : until);
  looked_ = found_ ? scheme_->time() : until;
  if (!found_ && to_kink) found_ = std::move(at_kink);
}

const double* FixedRun::course_at(double t) {
  const double* y = course_->motion(t);
  if (!scheme_->only_looks()) return y;
  // One that passes by w = 0 because of its errors of direction is one that stops.
  straight_.assign(y, y + scheme_->size());
  scheme_->stage_rows().slips().straighten(scheme_->assembly(), scheme_->kinematic_state(t, y),
                                           straight_.data() + scheme_->assembly().n());
  return straight_.data();
}

StateView FixedRun::within(double t, bool solved) {
  const double* y = course_at(t);
  return solved ? scheme_->mechanism_state(t, y) : scheme_->kinematic_state(t, y);
}

void FixedRun::look_for_event(double until) {
  if (!scheme_->has_events()) return;
  const auto t = scheme_->find_event(looked_, until, [&](double at) { return course_at(at); });
  if (!t) return;
  StepCut cut;
  cut.event = scheme_->pending_event();
  cut.name = scheme_->event_name(cut.event);
  const auto guard = [&, event = cut.event](const StateView& s) {
    return scheme_->events().guard_from(event, scheme_->begun(), s);
  };
  cut_step(std::move(cut), *t, guard, scheme_->events().needs_multipliers());
}

void FixedRun::look_for_end(double until) {
  if (!end_search_) return;
  const EndEvent& end = *problem_.ends_when;
  const bool solved = end.output->needs_accelerations();
  if (!end_search_->step(found_ ? scheme_->state() : within(until, solved), scheme_->assembly())) return;
  const auto distance = [&](const StateView& s) { return end.distance(s, scheme_->assembly()); };
  const auto t = end_search_->find([&](double at) { return distance(within(at, solved)); });
  if (!t) return;
  StepCut cut;
  cut.kind = StepCut::Kind::end;
  cut.name = end.text(scheme_->assembly());
  scheme_->forget_event();
  if (found_ && found_->instant) {
    cut.instant = true;
    found_ = std::move(cut);
  } else {
    cut_step(std::move(cut), *t, distance, solved);
  }
}

void FixedRun::cut_step(StepCut cut, double t, const std::function<double(const StateView&)>& value, bool solved) {
  const double begun = *scheme_->beginning().t, h = std::max(0.0, t - begun);
  cut.instant = h <= kInstantPart * scheme_->regular_length();
  if (cut.instant) {
    scheme_->take_back();
    scheme_->move_on(h, std::max(t, begun));
  } else {
    end_step_at(t, cut.name, cut.kind == StepCut::Kind::event, value, solved);
    course_->take_step();
  }
  found_ = std::move(cut);
}

void FixedRun::end_step_at(double t, const std::string& what, bool far_side,
                           const std::function<double(const StateView&)>& value, bool solved) {
  const double begun = *scheme_->beginning().t, whole = scheme_->length(), h0 = scheme_->regular_length();
  double h = t - begun, moved = whole;
  const double aside = h < 0.5 * whole ? kAsidePart * whole : -kAsidePart * whole;
  const double ahead = value(within(t + aside, solved));
  double rate = (ahead - value(within(t, solved))) / aside;
  const auto end_at = [&](double length) {
    h = length;
    scheme_->repeat(h, begun + h);
    return value(scheme_->state());
  };
  double last = end_at(h);
  for (int k = 0; k < kLengths; ++k) {
    const double change = -last / rate;
    // To rounding, or as far as it gets on.
    if (!(std::abs(change) < 0.5 * moved) || begun + h + change == begun + h || !(h + change > 0)) break;
    moved = std::abs(change);
    const double before = last;
    last = end_at(h + change);
    if (moved > kTellsRate * h0) rate = (last - before) / change;
  }
  if (!(std::abs(last) <= kMet * h0 * std::abs(rate)))
    throw SolverError(fmt::format(
        "A fixed step of {:.6g} s from t = {:.6g} s comes near to '{}' at t = {:.9g} s, but no length of it ends "
        "there: "
        "it is hardly met, or steps of this length are too long for the motion. Choose smaller ones (--step, "
        "run.step_s).",
        whole, begun, what, t));
  // Its far side: a force that begins there has begun, with its derivatives.
  double further = std::numeric_limits<double>::epsilon() * std::max(std::abs(begun + h), h);
  for (int k = 0; far_side && k < kLengths && !(last * rate > 0); ++k, further *= 2) last = end_at(h + further);
}

void FixedRun::require_new_time(double length) {
  jumps_in_a_row_ = length > kInstantPart * scheme_->regular_length() ? 0 : jumps_in_a_row_ + 1;
  if (jumps_in_a_row_ > kMostCutsAtOnce)
    throw SolverError(
        fmt::format("The run does not get beyond t = {:.9g} s: one segment follows another.", scheme_->time()));
}

void FixedRun::complete_cut() {
  StepCut& cut = *found_;
  const double t = scheme_->time();
  cut.index = scheme_->index();
  cut.length_before = scheme_->length();
  cut.t_after = t;
  cut.before.resize(scheme_->record_size());
  scheme_->save(cut.before.data());
  require_new_time(cut.length_before);
  if (differentiates()) cut.by_end = cut.instant ? length_->of_instant() : length_->by_end();
  if (cut.kind == StepCut::Kind::end) {
    end_ = RunEvent{t, cut.name};
    if (differentiates()) condition_of_end();
    return;
  }
  if (cut.kind == StepCut::Kind::kink) {
    cut.t_after = place_ + beside_;
    for (const MovingInstant& m : moving_)
      if (std::abs(m.t - place_) <= beside_) cut.by = m.by;
    scheme_->cross_kink(place_, cut.t_after);
    looked_ = cut.t_after;
  } else {
    scheme_->cross_event();
    scheme_->forget_event();
    events_.push_back({t, cut.name, scheme_->event_mode(cut.event), scheme_->event_jump(), scheme_->event_loss()});
  }
  cut.after.resize(scheme_->record_size());
  scheme_->save(cut.after.data());
  if (differentiates() && cut.kind == StepCut::Kind::event) crossing_->linearize_event(cut);
  scheme_->load(cut.index, cut.before.data());
}

namespace {
/// Of explicit time alone.
class TimeAlone {
 public:
  explicit TimeAlone(const Assembly& a)
      : none_(static_cast<std::size_t>(std::max({a.n(), a.m(), a.nz(), static_cast<int>(a.numbers().size())})), 0) {
    d_.t = 1;
    d_.q = d_.v = d_.a = d_.lambda = d_.z = d_.numbers = none_.data();
  }
  const Variation& operator*() const { return d_; }

 private:
  std::vector<double> none_;
  Variation d_;
};
}  // namespace

double FixedRun::time_change(const std::vector<std::shared_ptr<const CostTerm>>& terms) {
  Assembly& assembly = scheme_->assembly();
  const TimeAlone time(assembly);
  double sum = 0;
  for (const auto& term : terms) sum += term->change(scheme_->state(), assembly, *time);
  return sum;
}

void FixedRun::condition_of_end() {
  Assembly& assembly = scheme_->assembly();
  const EndEvent& end = *problem_.ends_when;
  StepCut& cut = *found_;
  const StateView s = scheme_->state();
  cut.condition.resize(assembly);
  cut.condition.set_zero();
  end.output->add_gradient(s, assembly, 1, cut.condition);
  if (end.level_number >= 0) cut.condition.add_number(assembly, end.level_number, -1);
  const bool rates = !(cut.condition.a.isZero(0) && cut.condition.lambda.isZero(0)) ||
                     scheme_->objective().terminal_needs_accelerations();
  if (cut.instant && rates)
    throw SolverError(fmt::format(
        "At t = {:.9g} s the run ends ('{}') in the instant of an event: what the accelerations do there is not known "
        "well enough for a derivative. Move the level.",
        s.t, cut.name));
  CutCrossing::set_rate(cut, s.t, end.output->change(s, assembly, *TimeAlone(assembly)));
}

void FixedRun::conclude_end() {
  const EndEvent& end = *problem_.ends_when;
  Assembly& assembly = scheme_->assembly();
  if (!end_) fail_without_end(problem_, *end_search_, assembly);
  const double range = end_search_->range(), run = end_->t - problem_.solver.t_start;
  if (differentiates()) {
    const double rate = cuts_.back().condition_rate;
    judge_end(problem_, assembly, end_->t, rate, std::abs(rate) * run / range);
  } else if (!end.output->needs_accelerations()) {  // they have no rate
    const double rate = end_rate(end, scheme_->state(), assembly, {});
    tell_hardly_crossed(problem_, assembly, end_->t, rate, std::abs(rate) * run / range);
  }
}

}  // namespace costate
