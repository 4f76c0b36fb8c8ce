#include "costate/element/law/hidden_jumps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/element/course.h"
#include "costate/element/law/formula_law.h"

namespace costate {

namespace {

/// Of the largest value; and of a change, by how much the middle of a cell may differ from that of its ends: what is
/// left of it is no jump then.
constexpr double kOfLargest = 1e-6, kFits = 1e-2;
/// Of cells, that are looked into.
constexpr std::size_t kMostLooked = 20'000;
constexpr double kNeighbour = 4e-16, kSmallestPlace = 1e-200;
/// Of the run: nearer jumps are one that is not quite at once. And of what rounding is taken to be.
constexpr double kSamePlace = 1e-9, kOfRounding = 10, kBesideCurvature = 1e-5;

double beyond(double x, double towards) { return std::nextafter(x, towards); }

/// Keeps the half of a < b that changes more, until these are neighbours.
template <class F>
void halve(const F& f, double& a, double& b, double& fa, double& fb) {
  for (;;) {
    const double middle = a + 0.5 * (b - a);
    if (!(middle > a && middle < b)) return;
    const double fm = f(middle);
    if (!std::isfinite(fm)) return;
    const bool left = std::abs(fm - fa) > std::abs(fb - fm);
    (left ? b : a) = middle;
    (left ? fb : fa) = fm;
  }
}

/// By how much ten values on either side of it, from `near` to ten times that away, are apart at least: what rounding
/// makes of a formula lies on both.
template <class F>
double apart(const F& f, const HiddenJump& jump, double near) {
  const double sign = jump.right > jump.left ? 1 : -1;
  double left = -HUGE_VAL, right = HUGE_VAL;
  for (double away = near; away < 10 * near; away *= 1.28) {
    left = std::max(left, sign * f(jump.x - away));
    right = std::min(right, sign * f(jump.x + away));
  }
  return right - left;
}

}  // namespace

HiddenJumps::HiddenJumps(const ScalarLaw& law, const double* p, double from, double to, double shift, double rate)
    : law_(law), p_(p), from_(rate * (from - shift)), to_(rate * (to - shift)), shift_(shift), rate_(rate) {
  if (!(from < to)) return;
  if (from_ > to_) std::swap(from_, to_);
  LawPlaces places;
  places.from = from_;
  places.to = to_;
  add_law_places(law, p, places);
  if (!places.search) return;
  Course course(from_, to_);
  course.add(law, p);
  course.finish();
  ends_ = {from_, to_};
  const auto add = [&](double x) {
    if (x > from_ && x < to_) ends_.push_back(x);
  };
  course.for_each_end(add);
  for (const double x : places.sharp) add(x);
  std::sort(ends_.begin(), ends_.end());
  ends_.erase(std::unique(ends_.begin(), ends_.end()), ends_.end());
  if (ends_.size() > kMostLooked) ends_.resize(kMostLooked);
}

double HiddenJumps::known(double x, JumpOf what) const {
  try {
    return what == JumpOf::value   ? law_.value(x, p_)
           : what == JumpOf::slope ? law_.slope(x, p_).d[0]
                                   : law_.curve(x, p_).c2;
  } catch (const StepError&) {  // where it says nothing
    return std::numeric_limits<double>::quiet_NaN();
  }
}

std::vector<HiddenJump> HiddenJumps::of(JumpOf what) const {
  const auto f = [&](double x) { return known(x, what); };
  double largest = 0;
  std::vector<HiddenJump> found;
  const auto meet = [&](double x, double left, double right) {
    if (std::isfinite(left) && std::isfinite(right) && left != right) found.push_back({x, left, right});
  };
  for (std::size_t k = 0; k + 1 < ends_.size(); ++k) {
    double a = beyond(ends_[k], to_), b = beyond(ends_[k + 1], from_);
    if (!(a < b)) continue;
    double fa = f(a), fb = f(b);
    const double middle = f(a + 0.5 * (b - a));
    for (const double y : {fa, fb, middle})
      if (std::isfinite(y)) largest = std::max(largest, std::abs(y));
    const bool fits = std::abs(middle - 0.5 * (fa + fb)) <= kFits * std::abs(fb - fa);
    if (fits || !std::isfinite(middle) || !std::isfinite(fa) || !std::isfinite(fb)) continue;
    halve(f, a, b, fa, fb);
    meet(b, fa, fb);
  }
  for (std::size_t k = 1; k + 1 < ends_.size(); ++k)
    meet(ends_[k], f(beyond(ends_[k], from_)), f(beyond(ends_[k], to_)));
  // What terms that cancel leave of a formula goes up and down by steps, too.
  const auto* formula = what == JumpOf::value ? dynamic_cast<const FormulaLaw*>(&law_) : nullptr;
  std::erase_if(found, [&](const HiddenJump& j) {
    const double rounding = formula ? kOfRounding * formula->rounding(j.x, p_) : 0;
    const double near = 100 * kNeighbour * std::max(std::abs(j.x), kSmallestPlace), jump = apart(f, j, near);
    if (!(jump > std::max(kOfLargest * largest, rounding))) return true;
    // Of second derivatives rounding makes stairs, which are none from farther away.
    return what == JumpOf::curvature && !(apart(f, j, kBesideCurvature * (to_ - from_)) > 0.5 * jump);
  });
  std::sort(found.begin(), found.end(), [](const HiddenJump& a, const HiddenJump& b) { return a.x < b.x; });
  const auto same = [&](const HiddenJump& a, const HiddenJump& b) { return b.x - a.x <= kSamePlace * (to_ - from_); };
  found.erase(std::unique(found.begin(), found.end(), same), found.end());
  for (HiddenJump& j : found) {
    j.x = shift_ + j.x / rate_;
    if (rate_ < 0) std::swap(j.left, j.right);
  }
  if (rate_ < 0) std::reverse(found.begin(), found.end());
  return found;
}

}  // namespace costate
