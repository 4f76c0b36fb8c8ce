// A point of space that elements attach to: fixed to the ground; free, in natural coordinates; fixed to a
// rigid body (x, y, z, e0, e1, e2, e3) at s in its frame, r = (x, y, z) + A(p) s; or fixed to a body in
// natural coordinates (x, y, z, u1, u2, u3), r = (x, y, z) + s_1 u_1 + s_2 u_2 + s_3 u_3. Gives the position
// and its exact derivatives on the point's own coordinates. See lib/README.md (11.16).
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "costate/element/point/rotation.h"

namespace costate {

class SpatialPoint {
 public:
  enum class Kind { ground, free, on_body, on_natural_body };
  static constexpr int kMaxCoordinates = 12;
  using Vector = Vector3;
  /// 3 x nq with nq <= 12, no heap.
  using Jacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxCoordinates>;

  /// numbers: x, y, z [m], on the ground or in the body's frame; none of a free point. coordinates: none, x,
  /// y, z, or the seven or twelve of the body.
  SpatialPoint(Kind kind, std::string name, std::vector<int> coordinates, std::vector<int> numbers)
      : kind_(kind), name_(std::move(name)), coordinates_(std::move(coordinates)), numbers_(std::move(numbers)) {}

  Kind kind() const { return kind_; }
  const std::string& name() const { return name_; }
  const std::vector<int>& coordinates() const { return coordinates_; }
  const std::vector<int>& numbers() const { return numbers_; }
  int size() const { return static_cast<int>(coordinates_.size()); }
  /// Whether directions are fixed to what the point is on: not to a free point.
  bool has_directions() const { return kind_ != Kind::free; }
  /// What a BodyDirection at this point depends on: Euler parameters, base vectors, or nothing on the ground.
  /// Throws ModelError for a free point.
  std::vector<int> direction_coordinates() const;
  /// The Euler parameters of its body; none on the ground. For elements that know no other rotations: throws
  /// ModelError for free points and for bodies in natural coordinates.
  std::vector<int> rotation_coordinates() const;

  /// r(q, p) [m].
  template <class S>
  void position(const S* q, const S* p, S* r) const {
    if (kind_ == Kind::on_body) {
      rotated(q + 3, p, r);
      for (int i = 0; i < 3; ++i) r[i] += q[i];
    } else if (kind_ == Kind::on_natural_body) {
      for (int i = 0; i < 3; ++i) r[i] = q[i] + p[0] * q[3 + i] + p[1] * q[6 + i] + p[2] * q[9 + i];
    } else {
      const S* x = kind_ == Kind::free ? q : p;
      for (int i = 0; i < 3; ++i) r[i] = x[i];
    }
  }
  /// rdot = r_q v.
  template <class S>
  void velocity(const S* q, const S* v, const S* p, S* r) const {
    if (kind_ == Kind::on_body) {
      rotated_rate(q + 3, v + 3, p, r);
      for (int i = 0; i < 3; ++i) r[i] += v[i];
    } else if (kind_ == Kind::ground) {
      for (int i = 0; i < 3; ++i) r[i] = S(0.0);
    } else {
      position(v, p, r);  // linear in q: the same map
    }
  }
  /// rddot = r_q a + (r_q v)_q v.
  template <class S>
  void acceleration(const S* q, const S* v, const S* a, const S* p, S* r) const {
    velocity(q, a, p, r);
    if (kind_ != Kind::on_body) return;
    S turning[3];
    rotated_rate(v + 3, v + 3, p, turning);
    for (int i = 0; i < 3; ++i) r[i] += turning[i];
  }
  /// Q += r_q^T f: the generalized force of a force f [N] at this point.
  template <class S>
  void add_generalized_force(const S* q, const S* p, const S* f, S* Q) const {
    if (kind_ == Kind::ground) return;
    for (int i = 0; i < 3; ++i) Q[i] += f[i];
    if (kind_ == Kind::on_body) add_rotated_force(q + 3, p, f, Q + 3);
    if (kind_ == Kind::on_natural_body)
      for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i) Q[3 + 3 * k + i] += p[k] * f[i];
  }

  /// r_q.
  Jacobian jacobian(const double* q, const double* p) const {
    Jacobian J(3, size());
    if (kind_ == Kind::ground) return J;
    J.leftCols<3>().setIdentity();
    if (kind_ == Kind::on_body) J.rightCols<4>() = rotation_jacobian(q + 3, Vector(p[0], p[1], p[2]));
    if (kind_ == Kind::on_natural_body)
      for (int k = 0; k < 3; ++k) J.middleCols<3>(3 + 3 * k) = p[k] * Eigen::Matrix3d::Identity();
    return J;
  }
  /// rdot_q = (r_q v)_q.
  Jacobian jacobian_dot(const double*, const double* v, const double* p) const { return curved(v, p); }
  /// rddot_q at fixed v, a.
  Jacobian acceleration_partial(const double*, const double*, const double* a, const double* p) const {
    return curved(a, p);
  }
  /// (r_q^T f)_q = K(s, f) for the Euler parameters of a rigid body, constant; zero for the other kinds.
  Eigen::Matrix4d curvature(const double* p, const Vector& f) const {
    return rotation_curvature(Vector(p[0], p[1], p[2]), f);
  }
  static constexpr int curvature_index = 3;

 private:
  Jacobian curved(const double* x, const double* p) const {
    Jacobian J = Jacobian::Zero(3, size());
    if (kind_ == Kind::on_body) J.rightCols<4>() = rotation_jacobian(x + 3, Vector(p[0], p[1], p[2]));
    return J;
  }

  Kind kind_;
  std::string name_;
  std::vector<int> coordinates_, numbers_;
};

}  // namespace costate
