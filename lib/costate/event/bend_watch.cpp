#include "costate/event/bend_watch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/assembly/gathered_state.h"
#include "costate/element/path_function.h"
#include "costate/objective/formula_output.h"

namespace costate {

namespace {
// Looks within a step where an argument that comes back could have been beyond the place: where it is nearer to it, at
// one of the ends, than this many times what it moves.
constexpr int kBendLooks = 3;
constexpr double kBendNear = 4;
// Of a step: to this the time is known. And the halvings at most.
constexpr double kBendResolved = 1e-9;
constexpr int kBendHalvings = 60;
// Of the way to a place, what one step takes.
constexpr double kApproach = 0.9;
// Steps across a place, in the length of the steps around them; and, of the time, at least.
constexpr double kAcross = 1e-6, kBendInstant = 16 * std::numeric_limits<double>::epsilon();
// Of the tolerances: a smaller argument is zero.
constexpr double kBendCounts = 0.1;

bool is_beyond(double x) { return x >= 0; }
}  // namespace

void BendWatch::add_laws(Assembly& assembly, const Element& force, const MotionLawElement& owner) {
  std::vector<MotionLaw> laws;
  owner.add_motion_laws(laws);
  for (const MotionLaw& law : laws) {
    if (!law.followed()) continue;
    const LawJoints joints = joints_of(force, law, assembly.numbers());
    for (const LawJoint& joint : joints.all)
      if (joints.bends(joint))
        places_.push_back({[&assembly, &force, &owner, law, x = joint.x](const StateView& s) {
          thread_local GatheredState own;
          const LocalState local = own.of(force, s, assembly.numbers());
          const GapMotion m = owner.deformation(local);
          return (law.of_rate ? m.rate : m.gap - local.p[law.origin]) - x;
        }});
  }
}

BendWatch::BendWatch(Assembly& assembly, const Objective& objective, double rtol, double atol)
    : rtol_(rtol), atol_(atol) {
  /// arguments(s, x) gives those of the formula.
  const auto add_formula = [&](const FormulaLaw& formula, const auto& arguments) {
    for (int k = 0; k < formula.bend_count(); ++k)
      places_.push_back({[&formula, arguments, k](const StateView& s) {
        thread_local std::vector<double> x;
        x.assign(static_cast<std::size_t>(formula.number_count()), 0);
        arguments(s, x.data());
        return formula.bend(k, s.t, x.data());
      }});
  };
  for (const auto& force : assembly.mechanism().forces()) {
    if (const auto* owner = dynamic_cast<const MotionLawElement*>(force.get())) add_laws(assembly, *force, *owner);
    if (const auto* formulas = dynamic_cast<const PathFunctionElement*>(force.get()))
      for (int i = 0; i < formulas->path_functions(); ++i)
        add_formula(formulas->path_function(i),
                    [&assembly, force = force.get(), formulas, i](const StateView& s, double* x) {
                      thread_local GatheredState own;
                      formulas->path_arguments(i, own.of(*force, s, assembly.numbers()), x);
                    });
  }
  for (const auto& term : objective.running)
    for (const FormulaOutput* formula : formulas_of(*term))
      // Of accelerations a step's ends tell nothing.
      if (!formula->needs_accelerations())
        add_formula(formula->definition().formula(),
                    [&assembly, formula](const StateView& s, double* x) { formula->arguments(s, assembly, x); });
}

std::optional<double> BendWatch::passed(double from, double to, double length, const GapTrace::States& at) {
  if (across(to - from)) return {};
  const auto t = first(from, to, at);
  if (!t) return {};
  const double half = std::max(0.25 * kAcross * std::max(length, to - from), kBendInstant * std::abs(to));
  across_ = 4 * half;
  // Stages at the end of a step are known less well than the end itself: where the step is long and ends at the place
  // they may be beyond it. So the place is approached.
  if (const double way = *t - from; (1 - kApproach) * way > half) return from + kApproach * way;
  return *t - half > from + half ? *t - half : std::min(to, *t + 2 * half);
}

// Another place may be passed before this one: whoever ends a step here looks again.
double BendWatch::passage(const Place& place, double left, double right, double resolution,
                          const GapTrace::States& at) const {
  const bool side = is_beyond(place.beyond(at(left)));
  for (int k = 0; k < kBendHalvings && right - left > resolution; ++k) {
    const double t = left + 0.5 * (right - left);
    (is_beyond(place.beyond(at(t))) == side ? left : right) = t;
  }
  return right;
}

std::optional<double> BendWatch::first(double from, double to, const GapTrace::States& at) {
  const auto look = [&](double t, std::vector<double>& values) {
    const StateView s = at(t);
    values.resize(places_.size());
    for (std::size_t i = 0; i < places_.size(); ++i) values[i] = places_[i].beyond(s);
  };
  look(from, begin_);
  look(to, end_);
  bool near = false;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const double a = std::abs(begin_[i]), b = std::abs(end_[i]);
    places_[i].largest = std::max({places_[i].largest, a, b});
    near = near || std::min(a, b) <= kBendNear * std::abs(end_[i] - begin_[i]);
  }
  if (!near) return {};
  double last = from;
  for (int k = 1; k <= kBendLooks + 1; ++k) {
    const bool whole = k > kBendLooks;
    const double now = whole ? to : from + (to - from) * k / (kBendLooks + 1);
    if (whole)
      now_ = end_;
    else
      look(now, now_);
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const double size = std::max(std::abs(begin_[i]), std::abs(now_[i]));
      if (is_beyond(begin_[i]) != is_beyond(now_[i]) && size > kBendCounts * (atol_ + rtol_ * places_[i].largest))
        return passage(places_[i], last, now, kBendResolved * (to - from), at);
    }
    last = now;
    begin_.swap(now_);
  }
  return {};
}

}  // namespace costate
