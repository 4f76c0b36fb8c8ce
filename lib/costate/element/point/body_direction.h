// A direction fixed to the ground or to a body of space, with its derivatives on the body's coordinates of
// rotation: u = A(p) s on the Euler parameters p of a rigid body, u = s_1 u_1 + s_2 u_2 + s_3 u_3 on the base
// vectors of a body in natural coordinates. The components s are handed in: they are numbers of an element,
// or follow from them.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "costate/element/point/rotation.h"

namespace costate {

class BodyDirection {
 public:
  static constexpr int kMax = 9;
  using Jacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMax>;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMax, kMax>;

  /// coordinates: none on the ground; e0, e1, e2, e3; or u1x, u1y, u1z, u2x, ..., u3z.
  explicit BodyDirection(std::vector<int> coordinates) : coordinates_(std::move(coordinates)) {}
  const std::vector<int>& coordinates() const { return coordinates_; }
  int size() const { return static_cast<int>(coordinates_.size()); }
  /// Whether u is linear in the coordinates, so that only u_q differs from zero.
  bool linear() const { return size() == kMax; }

  /// u.
  template <class S>
  void value(const S* q, const S* s, S* u) const {
    if (size() == 4) return rotated(q, s, u);
    for (int i = 0; i < 3; ++i) u[i] = linear() ? s[0] * q[i] + s[1] * q[3 + i] + s[2] * q[6 + i] : s[i];
  }
  Vector3 value(const double* q, const Vector3& s) const {
    Vector3 u;
    value(q, s.data(), u.data());
    return u;
  }
  /// u_q w = B(p, s) w.
  Vector3 rate(const double* q, const double* w, const Vector3& s) const {
    Vector3 u = Vector3::Zero();
    if (size() == 4) rotated_rate(q, w, s.data(), u.data());
    if (linear()) value(w, s.data(), u.data());
    return u;
  }
  /// (u_q v)_q v, which is uddot at a = 0.
  Vector3 turning(const double* v, const Vector3& s) const {
    Vector3 u = Vector3::Zero();
    if (size() == 4) rotated_rate(v, v, s.data(), u.data());
    return u;
  }
  /// u_q.
  Jacobian jacobian(const double* q, const Vector3& s) const {
    if (size() == 4) return rotation_jacobian(q, s);
    Jacobian J(3, size());
    for (int k = 0; k < size() / 3; ++k) J.middleCols<3>(3 * k) = s[k] * Eigen::Matrix3d::Identity();
    return J;
  }
  /// udot_q = (u_q v)_q at x = v, and uddot_q at x = a.
  Jacobian jacobian_dot(const double* x, const Vector3& s) const {
    if (size() == 4) return rotation_jacobian(x, s);
    return Jacobian::Zero(3, size());
  }
  /// H += factor (u_q^T f)_q = factor K(s, f), at the diagonal entry `at` on.
  template <class Matrix>
  void add_curvature(double factor, const Vector3& s, const Vector3& f, int at, Matrix& H) const {
    if (size() == 4) H.block(at, at, 4, 4) += factor * rotation_curvature(s, f);
  }

 private:
  std::vector<int> coordinates_;
};

/// The k of a unit vector e_k that lies well across the axis (|axis x e_k| >= 0.8 |axis|): the first of them, by a
/// bound that no axis along a coordinate is near. By the smallest component it would be another one to either side of
/// such axes, and so would be the directions that multipliers belong to.
inline int coordinate_across(const Vector3& axis) {
  constexpr double kAcross = 0.6;  // one component at least is below 3^-1/2
  const double most = kAcross * axis.norm();
  for (int k = 0; k < 2; ++k)
    if (std::abs(axis[k]) <= most) return k;
  return 2;
}

/// Two vectors perpendicular to the axis and to each other: axis x e_k and axis x (axis x e_k). They vary
/// smoothly with the axis as long as it does not come near e_k.
template <class S>
void perpendicular_pair(const S* axis, int k, S* first, S* second) {
  S unit[3] = {S(0.0), S(0.0), S(0.0)};
  unit[k] = S(1.0);
  cross3(axis, unit, first);
  cross3(axis, first, second);
}

/// a of length 1; may be written over it.
template <class S>
void unit_direction(const S* a, S* unit) {
  using std::sqrt;
  const S length = sqrt(dot3(a, a));
  for (int i = 0; i < 3; ++i) unit[i] = a[i] / length;
}

/// The perpendicular pair of length 1, whatever the axis's.
template <class S>
void perpendicular_units(const S* axis, int k, S* first, S* second) {
  perpendicular_pair(axis, k, first, second);
  unit_direction(first, first);
  unit_direction(second, second);
}

/// The part of `normal` across the axis, of length 1, and axis x that part, of length 1.
template <class S>
void across_axis(const S* axis, const S* normal, S* part, S* turned) {
  using std::sqrt;
  cross3(axis, normal, turned);
  cross3(turned, axis, part);
  const S length = sqrt(dot3(turned, turned)), part_length = sqrt(dot3(part, part));
  for (int i = 0; i < 3; ++i) {
    turned[i] /= length;
    part[i] /= part_length;
  }
}

}  // namespace costate
