#include "costate/element/force/road.h"

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

void Road::add_post_jumps(double shift, const double* p, std::vector<double>& times) const {
  const double speed = has_speed_ ? *p : 1;
  const LawJoints joints = law_joints(*law_, p + law_numbers());
  for (const LawJoint& j : joints.all)
    // The ramp begins at 0 and is level there.
    if ((joints.jumps(j) || joints.bends(j)) && (!has_ramp_ || j.x / speed > 0)) times.push_back(shift + j.x / speed);
}

}  // namespace costate
