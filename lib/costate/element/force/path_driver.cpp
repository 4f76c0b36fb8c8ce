#include "costate/element/force/path_driver.h"

namespace costate {

PathDriver::PathDriver(std::string name, SpatialPoint point, int coordinate, std::shared_ptr<const ScalarLaw> path,
                       const std::vector<int>& own, const std::vector<int>& path_numbers)
    : ForceOf("path_driver", std::move(name)), point_(std::move(point)), path_(std::move(path)) {
  append_coordinates(point_.coordinates());
  append_coordinates({coordinate});
  append_numbers(own);
  append_numbers(point_.numbers());
  append_numbers(path_numbers);
}

void PathDriver::calc_partials(const LocalState& s, ForcePartials out) const {
  using Row = Eigen::Matrix<double, 1, 4>;
  const double* p = s.p;
  const double *e = s.q + SpatialPoint::curvature_index, *ev = s.v + SpatialPoint::curvature_index;
  const int n = point_.size();
  // The point seen ahead, r + L h, and e = path(x) - y there.
  const Vector3 forward(1, 0, 0);
  Vector3 ahead, h;
  point_.position(s.q, p + own_numbers, ahead.data());
  rotated(e, forward.data(), h.data());
  ahead += p[preview] * h;
  auto ahead_q = point_.jacobian(s.q, p + own_numbers);
  ahead_q.rightCols<4>() += p[preview] * rotation_jacobian(e, forward);
  const double slope = path_->slope(ahead[0], p + own_numbers + 3).d[0];
  // E(e) e' = -E(e') e.
  const Row yaw_e = -2 * global_rate_matrix(ev).row(2), yaw_ev = 2 * global_rate_matrix(e).row(2);
  const double of_error = -p[gain] / p[decision_lag], of_yaw = p[yaw_gain] / p[decision_lag];
  out.f_q.row(0).head(n) = of_error * (slope * ahead_q.row(0) - ahead_q.row(1));
  out.f_q.row(0).segment<4>(SpatialPoint::curvature_index) += of_yaw * yaw_e;
  out.f_v.row(0).segment<4>(SpatialPoint::curvature_index) = of_yaw * yaw_ev;
  out.f_z(0, 0) = -1 / p[decision_lag];
  out.f_z(1, 0) = 1 / p[arm_lag];
  out.f_z(1, 1) = -1 / p[arm_lag];
  out.Q_q(n, n) = -p[stiffness];
  out.Q_v(n, n) = -p[damping];
  out.Q_z(n, 0) = p[damping] / p[arm_lag];
  out.Q_z(n, 1) = p[stiffness] - p[damping] / p[arm_lag];
}

CourseElement::Place PathDriver::track_place(int, const LocalState& s) const {
  const Vector3 forward(1, 0, 0);
  const int e = SpatialPoint::curvature_index;
  double r[3], v[3], h[3];
  point_.position(s.q, s.p + own_numbers, r);
  point_.velocity(s.q, s.v, s.p + own_numbers, v);
  rotated(s.q + e, forward.data(), h);
  const Vector3 turning = rotation_jacobian(s.q + e, forward) * Eigen::Map<const Eigen::Vector4d>(s.v + e);
  return {r[0] + s.p[preview] * h[0], v[0] + s.p[preview] * turning[0]};
}

void PathDriver::add_jump_places(const LocalState& s, bool, std::vector<JumpPlace>& places) const {
  const double forward[3] = {1, 0, 0};
  double h[3];
  rotated(s.q + SpatialPoint::curvature_index, forward, h);
  const bool right = s.p[gain] > 0;
  places.push_back({.beyond = right           ? h[0]
                              : s.p[gain] < 0 ? -h[0]
                                              : 1,
                    .direction = -1,
                    .what = right ? "steers away from its path: the vehicle heads against x, where a positive gain "
                                    "steers to the wrong side"
                                  : "steers away from its path: the vehicle heads along x, where a negative gain "
                                    "steers to the wrong side",
                    .advice = right ? "Let it drive towards larger x, or give the gain the other sign"
                                    : "Give the gain the other sign, or let it drive towards smaller x",
                    .of_motion = true});
}

PathDual PathDriver::measure(int i, const MeasureArguments& x) const {
  if (i == 0) return error(x.q, x.p);
  const int s = point_.size();
  if (i == 1) return x.p[stiffness] * (x.z[1] - x.q[s]) + x.p[damping] * ((x.z[0] - x.z[1]) / x.p[arm_lag] - x.v[s]);
  PathDual r[3];
  point_.position(x.q, x.p + own_numbers, r);
  return r[1] - path_->value(r[0], x.p + own_numbers + 3);
}

}  // namespace costate
