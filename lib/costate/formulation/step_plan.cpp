#include "costate/formulation/step_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "costate/assembly/gathered_state.h"
#include "costate/base/error.h"
#include "costate/formulation/own_courses.h"

namespace costate {

namespace {

// What is told in three digits, and is to be taken.
constexpr double kRoundedDown = 0.995;

/// Calls visit(element) for all.
template <class Visit>
void for_each_element(const Mechanism& m, const Visit& visit) {
  for (const auto& e : m.bodies()) visit(*e);
  for (const auto& e : m.constraints()) visit(*e);
  for (const auto& e : m.forces()) visit(*e);
}

/// Where the motion is on a track.
CourseElement::Place place_on(const Element& e, const CourseElement& course, int track,
                              const std::vector<double>& numbers, double t, const StateView& s) {
  GatheredState own;
  LocalState local = own.with(e, s, numbers.data());
  local.t = t;
  return course.track_place(track, local);
}

/// On its way to what is far ahead a body may become faster: half of the way is looked at, then half of the rest.
double distance(const Course::Bound& b, double x) {
  const double all = std::abs(b.end - x);
  return std::max(std::min(all, b.step), 0.5 * all);
}

}  // namespace

StepPlan::StepPlan(System& system, const Objective& objective, double t_start, double t_end, const double* y)
    : time_(t_start, t_end) {
  read(system.assembly(), objective, [&] { return system.kinematic_state(t_start, y); });
}

StepPlan::StepPlan(const Assembly& assembly, const Objective& objective, double t_start, double t_end,
                   const StateView& start)
    : time_(t_start, t_end) {
  read(assembly, objective, [&] { return start; });
}

void StepPlan::read(const Assembly& assembly, const Objective& objective, const std::function<StateView()>& start) {
  const std::vector<double>& all = assembly.numbers();
  const double t_start = time_.from(), span = time_.to() - t_start;
  bool known = false;
  StateView s;
  const auto first_state = [&]() -> const StateView& {
    if (!known) s = start();
    known = true;
    return s;
  };
  std::unique_ptr<Assembly> own;
  const auto search_own = [&](const OwnValue& value) {
    if (!value) return;
    if (!own) {
      own = std::make_unique<Assembly>(assembly.mechanism_ptr(), assembly.parameters());
      own->set_parameters(assembly.rho().data());
    }
    add_own_course(value, *own, first_state(), time_);
  };
  for_each_element(assembly.mechanism(), [&](const Element& e) {
    const auto* of = dynamic_cast<const CourseElement*>(&e);
    std::vector<double> p;
    for (const int n : e.numbers()) p.push_back(all[static_cast<std::size_t>(n)]);
    time_.begin_owner(e.kind() + " '" + e.name() + "'");
    if (!of) {
      bool told = false;
      for (const ElementCourse& add : element_courses()) told = told || add(e, p.data(), time_);
      if (!told && is_own(e)) search_own(own_value(assembly.mechanism(), e));
      return;
    }
    of->add_course(p.data(), time_);
    for (int i = 0; i < of->tracks(); ++i) {
      const CourseElement::Place at = place_on(e, *of, i, p, t_start, first_state());
      // Whatever the motion may reach: what is declared is known beyond it, too, what has to be searched is not.
      const double reach = 10 + 2 * std::max(1.0, std::abs(at.speed)) * span;
      Course course(at.at - reach, at.at + reach);
      course.begin_owner(e.kind() + " '" + e.name() + "'");
      of->add_track(i, p.data(), course);
      course.finish();
      if (!course.empty()) tracks_.push_back({&e, of, i, p, std::move(course)});
    }
  });
  for (const auto* terms : {&objective.running, &objective.terminal})
    for (const auto& term : *terms) {
      time_.begin_owner("a cost");
      add_cost_course(*term, all, time_);
      if (terms == &objective.running && is_own(*term)) search_own(own_value(*term));
    }
  time_.finish();
}

Course::Bound StepPlan::bound(double t, const StateView& s, bool backward) const {
  Course::Bound nearest = time_.bound(t, backward);
  for (const Track& track : tracks_) {
    const CourseElement::Place at = place_on(*track.element, *track.course_of, track.index, track.numbers, t, s);
    if (!(std::abs(at.speed) > 0) || !std::isfinite(at.at)) continue;
    const Course::Bound b = track.course.bound(at.at, (at.speed < 0) != backward);
    if (!std::isfinite(b.end)) continue;
    const double h = std::max(distance(b, at.at) / std::abs(at.speed), 1e-12 * std::abs(t));
    const double end = backward ? t - h : t + h;
    if (backward ? end > nearest.end : end < nearest.end) nearest = {end, b.step / std::abs(at.speed), -1};
  }
  return nearest;
}

double StepPlan::limit(System& system, double t, const double* y, bool backward) const {
  const StateView s = tracks_.empty() ? StateView() : system.kinematic_state(t, y);
  if (std::isnan(reversed_from_)) return bound(t, s, backward).end;
  return reversed_from_ - bound(reversed_from_ - t, s, !backward).end;
}

StepPlan StepPlan::reversed(double t_end) const {
  StepPlan plan = *this;
  plan.reversed_from_ = t_end;
  return plan;
}

StepPlan StepPlan::with_looks(const std::vector<TouchLook>& looks) const {
  StepPlan plan = *this;
  if (looks.empty()) return plan;
  plan.time_.begin_owner("a contact");
  for (const TouchLook& look : looks) plan.time_.add_look(look.from, look.to, look.step);
  plan.time_.finish();
  return plan;
}

void StepPlan::require(double t, const StateView& s, double h) const {
  const Course::Bound b = bound(t, s, false);
  // Twice what is asked of integrators, who look at their errors within.
  const double most = std::max(2 * b.step, b.end - t);
  if (!(h > most * (1 + 1e-9))) return;
  // What comes later in the run would be passed over next.
  double least = time_.least_step(t, time_.to());
  for (const Track& track : tracks_) {
    const CourseElement::Place at = place_on(*track.element, *track.course_of, track.index, track.numbers, t, s);
    const double speed = std::abs(at.speed), end = at.at + at.speed * (time_.to() - t);
    if (speed > 0) least = std::min(least, track.course.least_step(std::min(at.at, end), std::max(at.at, end)) / speed);
  }
  const std::string owner = b.owner >= 0 ? time_.owner(b.owner) : std::string("A road or path");
  throw SolverError(
      fmt::format("A fixed step of {:.6g} s from t = {:.6g} s passes over what begins or changes there: {} "
                  "has a law with a part that needs steps of {:.3g} s or less. Choose such a step (--step, "
                  "run.step_s).",
                  h, t, owner, kRoundedDown * std::min(most, 2 * least)));
}

}  // namespace costate
