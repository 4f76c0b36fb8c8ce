#include "costate/element/force/spatial_force.h"

#include <algorithm>

namespace costate {

SpatialPointForce::SpatialPointForce(std::string name, SpatialPoint point, VectorLaw law,
                                     const std::vector<int>& law_numbers, ForceFrame frame)
    : ForceOf("force", std::move(name)), point_(std::move(point)), law_(std::move(law)), frame_(frame) {
  append_coordinates(point_.coordinates());
  append_numbers(law_numbers);
  append_numbers(point_.numbers());
}

void SpatialPointForce::calc_partials(const LocalState& s, ForcePartials out) const {
  if (point_.kind() != SpatialPoint::Kind::on_body) return;  // r_q is constant
  constexpr int k = SpatialPoint::curvature_index;
  const double *point = s.p + law_.number_count(), *e = s.q + k;
  Vector3 f;
  law_(s.t, s.p, f.data());
  if (frame_ == ForceFrame::ground) {
    out.Q_q.block<4, 4>(k, k) = point_.curvature(point, f);
    return;
  }
  Vector3 turned;
  rotated(e, f.data(), turned.data());
  out.Q_q.block<4, 4>(k, k) = point_.curvature(point, turned);
  out.Q_q.middleCols<4>(k) += point_.jacobian(s.q, point).transpose() * rotation_jacobian(e, f);
}

SpatialCouple::SpatialCouple(std::string name, const std::vector<int>& rotations, VectorLaw law,
                             const std::vector<int>& law_numbers, ForceFrame frame)
    : ForceOf("couple", std::move(name)), law_(std::move(law)), frame_(frame) {
  append_coordinates(rotations);
  append_numbers(law_numbers);
}

void SpatialCouple::calc_partials(const LocalState& s, ForcePartials out) const {
  const int j = coordinates().size() == 8 ? 4 : 0;
  Vector3 m, ground;
  law_(s.t, s.p, m.data());
  ground = m;
  if (frame_ == ForceFrame::body) rotated(s.q, m.data(), ground.data());
  // (E^T b)_p = [[0, -b^T], [b, b~]].
  Eigen::Matrix4d turning = Eigen::Matrix4d::Zero();
  turning.block<1, 3>(0, 1) = -ground.transpose();
  turning.block<3, 1>(1, 0) = ground;
  turning.block<3, 3>(1, 1) = cross_matrix(ground);
  out.Q_q.block<4, 4>(j, j) = 2 * turning;
  if (j > 0) out.Q_q.topLeftCorner<4, 4>() = -2 * turning;
  if (frame_ == ForceFrame::ground) return;
  const Matrix34 ground_q = rotation_jacobian(s.q, m);
  out.Q_q.block<4, 4>(j, 0) += 2 * global_rate_matrix(s.q + j).transpose() * ground_q;
  if (j > 0) out.Q_q.topLeftCorner<4, 4>() -= 2 * global_rate_matrix(s.q).transpose() * ground_q;
}

PathDual SpatialPointForce::measure(int i, const MeasureArguments& x) const {
  PathDual f[3], turned[3], v[3];
  law_(x.t, x.p, f);
  if (frame_ == ForceFrame::body) rotated(x.q + SpatialPoint::curvature_index, f, turned);
  const PathDual* force = frame_ == ForceFrame::body ? turned : f;
  if (i < 3) return force[i];
  point_.velocity(x.q, x.v, x.p + law_.number_count(), v);
  return dot3(force, v);
}

PathDual SpatialCouple::measure(int i, const MeasureArguments& x) const {
  PathDual m[3], ground[3];
  law_(x.t, x.p, m);
  if (frame_ == ForceFrame::ground)
    std::copy(m, m + 3, ground);
  else
    rotated(x.q, m, ground);
  if (i < 3) return ground[i];
  // M.omega = 2 M^T E e' = Q e'
  PathDual Q[8];
  std::fill(Q, Q + 8, PathDual(0.0));
  physics<PathDual>(x.t, x.q, x.v, x.z, x.p, Q, nullptr);
  PathDual power(0.0);
  for (std::size_t k = 0; k < coordinates().size(); ++k) power += Q[k] * x.v[k];
  return power;
}

}  // namespace costate
