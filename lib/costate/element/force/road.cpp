#include "costate/element/force/road.h"

#include <cmath>

#include "costate/element/law/motion_law.h"

namespace costate {

void law_with_slope(const ScalarLaw& f, const PathDual& x, const PathDual* p, PathDual& y, PathDual& y_x) {
  thread_local std::vector<DirectedPathDual> numbers;
  const auto n = static_cast<std::size_t>(f.number_count());
  if (numbers.size() < n) numbers.resize(n);
  for (std::size_t i = 0; i < n; ++i) numbers[i] = DirectedPathDual(p[i]);
  const DirectedPathDual r = f.value(DirectedPathDual::variable(x, 0), numbers.data());
  y = r.v;
  y_x = r.d[0];
}

double Road::post_time(double x, double shift, const double* p) const {
  const double speed = has_speed_ ? *p : 1, t = shift + x / speed;
  const auto reached = [&](double at) { return (at - shift) * speed >= x; };
  double width = 1e-15 * (std::abs(t) + std::abs(shift) + std::abs(x / speed));
  if (!std::isfinite(width) || !(speed > 0)) return t;
  double before = t - width, after = t + width;
  if (reached(before) || !reached(after)) return t;
  for (double middle; middle = before + (after - before) / 2, before < middle && middle < after;)
    (reached(middle) ? after : before) = middle;
  return after;
}

void Road::add_motion_laws(int first, std::vector<MotionLaw>& laws) const {
  if (kind_ != Kind::profile) return;
  MotionLaw law{law_.get(), first + law_numbers(), "road", true};
  if (has_ramp_) law.from = 0;
  laws.push_back(std::move(law));
}

void Road::add_post_jumps(double shift, const double* p, std::vector<double>& times) const {
  if (kind_ != Kind::post) return;
  const LawJoints joints = law_joints(*law_, p + law_numbers());
  for (const LawJoint& j : joints.all)
    // The ramp begins at 0 and is level there.
    if ((joints.jumps(j) || joints.bends(j)) && (!has_ramp_ || j.x / (has_speed_ ? *p : 1) > 0))
      times.push_back(post_time(j.x, shift, p));
}

void Road::add_post_bends(double shift, const double* p, std::vector<double>& times) const {
  if (kind_ != Kind::post) return;
  std::vector<double> places;
  law_->add_curvature_jumps(p + law_numbers(), places);
  for (const double x : places) times.push_back(post_time(x, shift, p));
}

void Road::add_post_slopes(double t, double shift, const double* p, double& by_shift, double* slopes) const {
  if (kind_ != Kind::post) return;
  const double speed = has_speed_ ? *p : 1;
  for (const LawJoint& j : law_joints(*law_, p + law_numbers()).all) {
    if (post_time(j.x, shift, p) != t) continue;
    by_shift += 1;
    if (has_speed_) *slopes -= j.x / (speed * speed);
    std::vector<double> by_law(static_cast<std::size_t>(law_->number_count()), 0);
    law_->add_place_slopes(j.x, p + law_numbers(), by_law.data());
    for (std::size_t k = 0; k < by_law.size(); ++k) slopes[law_numbers() + static_cast<int>(k)] += by_law[k] / speed;
    return;
  }
}

}  // namespace costate
