#include "costate/adjoint/steep_begins.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "costate/assembly/gathered_state.h"
#include "costate/base/error.h"
#include "costate/element/gap_element.h"
#include "costate/element/guarded_force.h"
#include "costate/element/law/motion_law.h"
#include "costate/element/power_touch.h"

namespace costate {

namespace {

/// Nearer to 1 or 2 than this an exponent is that number: (eps)^1e-9 is 1 to some 4e-8.
constexpr double kIntegerPower = 1e-9;
/// From here on the clock beside an event is enough.
constexpr double kClockTakes = 1.5;
/// How far from a place a law is looked at: of the way to the next one, and of the place's own size.
constexpr double kOfWay = 1e-3, kOfPlace = 1e-4;
/// What counts of a change of the curvature: of itself, and of the slope over the distance.
constexpr double kOfCurvature = 1e-6, kOfSlope = 1e-12;

bool is_steep(double exponent, double below) {
  return exponent > 1 + kIntegerPower && exponent < below - kIntegerPower;
}

/// Whether the curvature grows without bound towards x from this side. At distances halved again and again what is
/// smooth changes by half as much each time, |x|^n by 2^(2-n) times as much.
bool begins_steeply(const ScalarLaw& law, const double* p, double x, double side, double way) {
  const double at = std::min(kOfWay * way, kOfPlace * (x == 0 ? 1 : std::abs(x)));
  // Nearer than that rounding of x is all that is seen.
  if (!(at > 1e-9 * std::abs(x))) return false;
  std::array<double, 4> curvature;
  double slope = 0, distance = at;
  try {
    for (double& c : curvature) {
      const Taylor2 f = law.curve(x + side * distance, p);
      c = f.c2;
      slope = std::max(slope, std::abs(f.c1));
      distance *= 0.5;
    }
  } catch (const StepError&) {
    return false;  // the law says nothing there
  }
  std::array<double, 3> change;
  for (std::size_t i = 0; i < change.size(); ++i) change[i] = curvature[i + 1] - curvature[i];
  const double counts = std::max(kOfCurvature * std::abs(curvature.back()), kOfSlope * slope / at);
  return std::abs(change[0]) > counts && change[1] / change[0] > 1 && change[2] / change[1] > 1;
}

}  // namespace

const SteepBegins& SteepBegins::of(const Assembly& assembly) {
  thread_local SteepBegins last;
  if (last.mechanism_.lock() != assembly.mechanism_ptr() || last.numbers_ != assembly.numbers())
    last = SteepBegins(assembly);
  return last;
}

SteepBegins::SteepBegins(const Assembly& assembly)
    : mechanism_(assembly.mechanism_ptr()), numbers_(assembly.numbers()) {
  const Mechanism& mechanism = assembly.mechanism();
  std::vector<double> p;
  for (std::size_t k = 0; k < mechanism.forces().size(); ++k) {
    const Force& force = *mechanism.forces()[k];
    add_laws(force, k);
    const auto* power = dynamic_cast<const PowerTouch*>(&force);
    if (!power) continue;
    p.clear();
    for (const int number : force.numbers()) p.push_back(numbers_[static_cast<std::size_t>(number)]);
    const double n = power->touch_exponent(p.data());
    const auto* guarded = dynamic_cast<const GuardedForce*>(&force);
    const bool event = guarded && guarded->guard_count() > 0;
    if (is_steep(n, 2)) (event ? events_ : touches_).push_back({k, n});
  }
}

void SteepBegins::add_laws(const Force& force, std::size_t k) {
  const auto* owner = dynamic_cast<const MotionLawElement*>(&force);
  if (!owner) return;
  std::vector<MotionLaw> laws;
  owner->add_motion_laws(laws);
  std::vector<double> p, x;
  for (const MotionLaw& law : laws) {
    if (!law.followed()) continue;
    p.clear();
    for (int i = 0; i < law.law->number_count(); ++i)
      p.push_back(numbers_[static_cast<std::size_t>(force.numbers()[static_cast<std::size_t>(law.first + i)])]);
    x.clear();
    for (const LawJoint& joint : law_joints(*law.law, p.data(), law.from).all) x.push_back(joint.x);
    x.erase(std::unique(x.begin(), x.end()), x.end());
    std::vector<Place> places;
    for (std::size_t i = 0; i < x.size(); ++i) {
      constexpr double kNone = std::numeric_limits<double>::infinity();
      const double below = i > 0 ? x[i] - x[i - 1] : kNone, above = i + 1 < x.size() ? x[i + 1] - x[i] : kNone;
      if (begins_steeply(*law.law, p.data(), x[i], 1, above))
        places.push_back({x[i], 1});
      else if (begins_steeply(*law.law, p.data(), x[i], -1, below))
        places.push_back({x[i], -1});
    }
    if (!places.empty())
      laws_.push_back({k, law.origin, law.of_rate, fmt::format("{}.{}", force.path(), law.key), std::move(places)});
  }
}

LocalState SteepBegins::local(const Mechanism& mechanism, std::size_t k, const StateView& s) const {
  thread_local GatheredState own;
  LocalState at = own.of(*mechanism.forces()[k], s, numbers_);
  at.z = s.z + mechanism.state_offsets()[k];
  return at;
}

void SteepBegins::append(const StateView& s, std::vector<double>& values) const {
  if (laws_.empty() && touches_.empty()) return;
  const auto held = mechanism_.lock();
  const Mechanism& mechanism = *held;
  for (const OfLaw& law : laws_) {
    const auto& owner = dynamic_cast<const MotionLawElement&>(*mechanism.forces()[law.force]);
    const LocalState at = local(mechanism, law.force, s);
    const GapMotion m = owner.deformation(at);
    const double x = law.of_rate ? m.rate : m.gap - at.p[law.origin];
    for (const Place& place : law.places) values.push_back(place.side * (x - place.x) > 0 ? 1 : 0);
  }
  for (const OfTouch& touch : touches_) {
    const std::size_t first = values.size();
    dynamic_cast<const GapElement&>(*mechanism.forces()[touch.force])
        .add_bends(local(mechanism, touch.force, s), values);
    for (std::size_t i = first; i < values.size(); ++i) values[i] = values[i] > 0 ? 1 : 0;
  }
}

void SteepBegins::refuse_between(const StateView& before, const StateView& after) const {
  if (laws_.empty() && touches_.empty()) return;
  std::vector<double> left, right;
  append(before, left);
  append(after, right);
  const auto held = mechanism_.lock();
  const Mechanism& mechanism = *held;
  std::size_t i = 0;
  for (const OfLaw& law : laws_)
    for (const Place& place : law.places) {
      if (left[i] != right[i])
        refuse(before.t, fmt::format("'{}' begins or ends to act at {:.6g}, where its second derivative is infinite",
                                     law.name, place.x));
      ++i;
    }
  for (const OfTouch& touch : touches_) {
    const Force& force = *mechanism.forces()[touch.force];
    const int count = dynamic_cast<const GapElement&>(force).gap_count();
    for (int point = 0; point < count; ++point, ++i)
      if (left[i] != right[i])
        refuse(before.t,
               fmt::format("'{}' touches or lets go, where the second derivative of a force with the exponent "
                           "{:.6g}, between 1 and 2, is infinite",
                           force.path(), touch.exponent));
  }
}

void SteepBegins::refuse_changed(double t, const double* z_before, const double* z_after) const {
  if (events_.empty()) return;
  const auto held = mechanism_.lock();
  const Mechanism& mechanism = *held;
  for (const OfTouch& touch : events_) {
    const Force& force = *mechanism.forces()[touch.force];
    const int first = mechanism.state_offsets()[touch.force];
    if (is_steep(touch.exponent, kClockTakes) &&
        !std::equal(z_before + first, z_before + first + force.states(), z_after + first))
      refuse(t, fmt::format("'{}' touches or lets go, where the second derivative of a force with the exponent {:.6g}, "
                            "between 1 and 1.5, grows too steeply",
                            force.path(), touch.exponent));
  }
}

double SteepBegins::exponent_between(const double* z_before, const double* z_after) const {
  double least = 2;
  if (events_.empty()) return least;
  const auto held = mechanism_.lock();
  for (const OfTouch& touch : events_) {
    const int first = held->state_offsets()[touch.force], last = first + held->forces()[touch.force]->states();
    if (!std::equal(z_before + first, z_before + last, z_after + first)) least = std::min(least, touch.exponent);
  }
  return least;
}

void SteepBegins::refuse(double t, const std::string& what) {
  throw CapabilityError(fmt::format(
      "At t = {:.6g} s {}: second derivatives are not carried across. Differences of gradients tell them.", t, what));
}

}  // namespace costate
