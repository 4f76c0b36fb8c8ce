#include "costate/element/law/motion_law.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/element/course.h"

namespace costate {

namespace {
/// Of the size: printed data joins pieces to this (kind/law/piecewise_law.h).
constexpr double kJoin = 1e-3;
/// Between two joints: a bump vanishes at both.
constexpr double kBetween[] = {0.23, 0.5, 0.81};
}  // namespace

// At a joint at zero the neighbouring number, 5e-324, is a place like any other: what a law makes of it is no size.
bool LawJoints::jumps(const LawJoint& j) const {
  return !(std::abs(j.right - j.left) <= std::max(kJoin * value, std::numeric_limits<double>::min()));
}
bool LawJoints::bends(const LawJoint& j) const { return !(std::abs(j.right_slope - j.left_slope) <= kJoin * slope); }

LawJoints law_joints(const ScalarLaw& law, const double* p, double from) {
  LawPlaces places;
  places.from = -1e300;
  places.to = 1e300;
  add_law_places(law, p, places);
  std::vector<double>& x = places.sharp;
  std::erase_if(x, [](double at) { return !std::isfinite(at); });
  LawJoints joints;
  const auto look = [&](double at) {
    const Dual<1> f = law.slope(at, p);
    if (std::isfinite(f.v)) joints.value = std::max(joints.value, std::abs(f.v));
    if (std::isfinite(f.d[0])) joints.slope = std::max(joints.slope, std::abs(f.d[0]));
    return f;
  };
  for (const double at : x) {
    const Dual<1> left = look(std::nextafter(at, -std::numeric_limits<double>::infinity())), right = look(at);
    joints.all.push_back({at, left.v, right.v, left.d[0], right.d[0]});
  }
  std::sort(x.begin(), x.end());
  for (std::size_t k = 0; k + 1 < x.size(); ++k)
    for (const double w : kBetween) look(x[k] + w * (x[k + 1] - x[k]));
  // And outside: a stop that begins at its only joint is zero there but for rounding.
  if (!x.empty()) {
    const double reach = 0.5 * std::max({x.back() - x.front(), std::abs(x.front()), std::abs(x.back())});
    for (const double at : {x.front() - reach, x.back() + reach}) look(at);
  }
  // The sizes are those of the whole law.
  std::erase_if(joints.all, [&](const LawJoint& j) { return j.x < from; });
  return joints;
}

}  // namespace costate
