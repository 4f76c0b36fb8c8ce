#include "costate/element/law/motion_law.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/element/course.h"

namespace costate {

namespace {
/// Of the size: printed data joins pieces to this (kind/law/piecewise_law.h).
constexpr double kJoin = 1e-3;
/// Of the size: a smaller jump is rounding.
constexpr double kValueJump = 1e-9;
/// Between two joints: a bump vanishes at both.
constexpr double kBetween[] = {0.23, 0.5, 0.81};
}  // namespace

// At a joint at zero the neighbouring number, 5e-324, is a place like any other: what a law makes of it is no size.
bool LawJoints::jumps(const LawJoint& j) const {
  return !(std::abs(j.right - j.left) <= std::max(kJoin * value, std::numeric_limits<double>::min()));
}
bool LawJoints::bends(const LawJoint& j) const { return !(std::abs(j.right_slope - j.left_slope) <= kJoin * slope); }

namespace {
/// The places that the law knows of, in order.
std::vector<double> places_of(const ScalarLaw& law, const double* p) {
  LawPlaces places;
  places.from = -1e300;
  places.to = 1e300;
  add_law_places(law, p, places);
  std::erase_if(places.sharp, [](double at) { return !std::isfinite(at); });
  std::sort(places.sharp.begin(), places.sharp.end());
  return std::move(places.sharp);
}

/// How far outside of its places a law is looked at.
double reach_of(const std::vector<double>& x) {
  return 0.5 * std::max({x.back() - x.front(), std::abs(x.front()), std::abs(x.back())});
}

/// The law and its slope; NaN where it says nothing (data that are refused beyond their ends).
Dual<1> known_slope(const ScalarLaw& law, double x, const double* p) {
  try {
    return law.slope(x, p);
  } catch (const StepError&) {
    Dual<1> nothing(std::nan(""));
    nothing.d[0] = nothing.v;
    return nothing;
  }
}
}  // namespace

std::vector<LawBegin> law_begins(const ScalarLaw& law, const double* p) {
  std::vector<double> x = places_of(law, p);
  x.erase(std::unique(x.begin(), x.end()), x.end());
  if (x.empty()) return {};
  const double reach = std::max(reach_of(x), std::numeric_limits<double>::min());
  // constant[k]: below x[k]; the last one above all.
  std::vector<bool> constant;
  const auto is_flat = [&](double at) { return known_slope(law, at, p).d[0] == 0; };
  for (std::size_t k = 0; k <= x.size(); ++k) {
    const double from = k == 0 ? x.front() - reach : x[k - 1], to = k == x.size() ? x.back() + reach : x[k];
    constant.push_back(std::all_of(std::begin(kBetween), std::end(kBetween),
                                   [&](double w) { return is_flat(from + w * (to - from)); }));
  }
  std::vector<LawBegin> begins;
  for (std::size_t k = 0; k < x.size(); ++k)
    if (constant[k] != constant[k + 1]) begins.push_back({x[k], constant[k] ? -1.0 : 1.0});
  return begins;
}

LawJoints law_joints(const ScalarLaw& law, const double* p, double from) {
  const std::vector<double> x = places_of(law, p);
  LawJoints joints;
  const auto look = [&](double at) {
    const Dual<1> f = known_slope(law, at, p);
    if (std::isfinite(f.v)) joints.value = std::max(joints.value, std::abs(f.v));
    if (std::isfinite(f.d[0])) joints.slope = std::max(joints.slope, std::abs(f.d[0]));
    return f;
  };
  for (const double at : x) {
    const Dual<1> left = look(std::nextafter(at, -std::numeric_limits<double>::infinity())), right = look(at);
    joints.all.push_back({at, left.v, right.v, left.d[0], right.d[0]});
  }
  for (std::size_t k = 0; k + 1 < x.size(); ++k)
    for (const double w : kBetween) look(x[k] + w * (x[k + 1] - x[k]));
  // And outside: a stop that begins at its only joint is zero there but for rounding.
  if (!x.empty()) {
    const double reach = reach_of(x);
    for (const double at : {x.front() - reach, x.back() + reach}) look(at);
  }
  // The sizes are those of the whole law.
  std::erase_if(joints.all, [&](const LawJoint& j) { return j.x < from; });
  return joints;
}

void add_value_jumps(const ScalarLaw& law, const double* p, std::vector<double>& x) {
  const LawJoints joints = law_joints(law, p);
  for (const LawJoint& j : joints.all)
    if (std::abs(j.right - j.left) > std::max(kValueJump * joints.value, std::numeric_limits<double>::min()))
      x.push_back(j.x);
}

LawJoints joints_of(const Element& element, const MotionLaw& law, const std::vector<double>& numbers) {
  std::vector<double> p;
  for (int k = 0; k < law.law->number_count(); ++k)
    p.push_back(numbers[static_cast<std::size_t>(element.numbers()[static_cast<std::size_t>(law.first + k)])]);
  return law_joints(*law.law, p.data(), law.from);
}

}  // namespace costate
