// A direction fixed to the ground or to a rigid body, u = A(p) s, with its derivatives on the body's Euler
// parameters. The components s are handed in: they are numbers of an element, or follow from them.
#pragma once

#include <utility>
#include <vector>

#include "costate/element/point/rotation.h"

namespace costate {

class BodyDirection {
 public:
  using Jacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 4>;

  /// coordinates: none on the ground, else e0, e1, e2, e3.
  explicit BodyDirection(std::vector<int> coordinates) : coordinates_(std::move(coordinates)) {}
  const std::vector<int>& coordinates() const { return coordinates_; }
  int size() const { return static_cast<int>(coordinates_.size()); }

  /// u.
  template <class S>
  void value(const S* q, const S* s, S* u) const {
    if (size() > 0) return rotated(q, s, u);
    for (int i = 0; i < 3; ++i) u[i] = s[i];
  }
  Vector3 value(const double* q, const Vector3& s) const {
    Vector3 u;
    value(q, s.data(), u.data());
    return u;
  }
  /// u_q w = B(p, s) w.
  Vector3 rate(const double* q, const double* w, const Vector3& s) const {
    Vector3 u = Vector3::Zero();
    if (size() > 0) rotated_rate(q, w, s.data(), u.data());
    return u;
  }
  /// u_q at the Euler parameters x: with v in their place this is udot_q, with a it is uddot_q.
  Jacobian jacobian(const double* x, const Vector3& s) const {
    if (size() == 0) return Jacobian(3, 0);
    return rotation_jacobian(x, s);
  }

 private:
  std::vector<int> coordinates_;
};

/// The unit vector e_k for which axis x e_k is longest: k of the smallest component.
inline int flattest(const Vector3& axis) {
  Eigen::Index k;
  axis.cwiseAbs().minCoeff(&k);
  return static_cast<int>(k);
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

}  // namespace costate
