// A point of the plane that elements attach to: fixed to the ground, a free point in natural coordinates,
// fixed to a rigid body (x, y, angle), or fixed to a bar (two points in natural coordinates, one of them perhaps on
// the ground). Gives position r(q, p) and its exact derivatives on the point's own coordinates.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

namespace costate {

class PlanarPoint {
 public:
  enum class Kind { ground, free, on_body, on_bar, on_bar_from_ground, on_bar_to_ground };
  static constexpr int kMaxCoordinates = 4;
  static constexpr int kMaxNumbers = 5;
  using Vector = Eigen::Vector2d;
  /// 2 x nq with nq <= 4, no heap.
  using Jacobian = Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, 2 * kMaxCoordinates>;

  /// ground: numbers x, y [m]. free: coordinates x, y. on_body: coordinates x, y, angle, numbers: local x, y [m].
  /// on_bar: coordinates of both ends, numbers: distance along and across [m], bar length [m].
  /// on_bar_from_ground, on_bar_to_ground: coordinates of the free end, numbers: those, then x, y of the other.
  PlanarPoint(Kind kind, std::string name, std::vector<int> coordinates, std::vector<int> numbers)
      : kind_(kind), name_(std::move(name)), coordinates_(std::move(coordinates)), numbers_(std::move(numbers)) {}

  Kind kind() const { return kind_; }
  const std::string& name() const { return name_; }
  const std::vector<int>& coordinates() const { return coordinates_; }
  const std::vector<int>& numbers() const { return numbers_; }
  int size() const { return static_cast<int>(coordinates_.size()); }

  /// r(q, p) [m].
  template <class S>
  void position(const S* q, const S* p, S& x, S& y) const {
    using std::cos;
    using std::sin;
    switch (kind_) {
      case Kind::ground:
        x = p[0];
        y = p[1];
        return;
      case Kind::free:
        x = q[0];
        y = q[1];
        return;
      case Kind::on_body: {
        const S c = cos(q[2]), s = sin(q[2]);
        x = q[0] + c * p[0] - s * p[1];
        y = q[1] + s * p[0] + c * p[1];
        return;
      }
      case Kind::on_bar:
        return between(q, q + 2, p, x, y);
      case Kind::on_bar_from_ground:
        return between(p + 3, q, p, x, y);
      case Kind::on_bar_to_ground:
        return between(q, p + 3, p, x, y);
    }
  }

  /// rdot = r_q v.
  template <class S>
  void velocity(const S* q, const S* v, const S* p, S& x, S& y) const {
    using std::cos;
    using std::sin;
    switch (kind_) {
      case Kind::ground:
        x = S(0.0);
        y = S(0.0);
        return;
      case Kind::on_body: {
        const S c = cos(q[2]), s = sin(q[2]);
        x = v[0] - v[2] * (s * p[0] + c * p[1]);
        y = v[1] + v[2] * (c * p[0] - s * p[1]);
        return;
      }
      case Kind::free:
      case Kind::on_bar:  // linear in q: the same map
        position(v, p, x, y);
        return;
      case Kind::on_bar_from_ground: {
        const S rest[2] = {S(0.0), S(0.0)};
        return between(rest, v, p, x, y);
      }
      case Kind::on_bar_to_ground: {
        const S rest[2] = {S(0.0), S(0.0)};
        return between(v, rest, p, x, y);
      }
    }
  }

  /// rddot = r_q a + (r_q v)_q v.
  template <class S>
  void acceleration(const S* q, const S* v, const S* a, const S* p, S& x, S& y) const {
    using std::cos;
    using std::sin;
    if (kind_ != Kind::on_body) return velocity(q, a, p, x, y);
    const S c = cos(q[2]), s = sin(q[2]);
    const S rx = c * p[0] - s * p[1], ry = s * p[0] + c * p[1];
    x = a[0] - a[2] * ry - v[2] * v[2] * rx;
    y = a[1] + a[2] * rx - v[2] * v[2] * ry;
  }

  /// Q += r_q^T f: the generalized force of a force f [N] at this point.
  template <class S>
  void add_generalized_force(const S* q, const S* p, const S* f, S* Q) const {
    using std::cos;
    using std::sin;
    switch (kind_) {
      case Kind::ground:
        return;
      case Kind::free:
        Q[0] += f[0];
        Q[1] += f[1];
        return;
      case Kind::on_body: {
        const S c = cos(q[2]), s = sin(q[2]);
        Q[0] += f[0];
        Q[1] += f[1];
        Q[2] += (c * p[0] - s * p[1]) * f[1] - (s * p[0] + c * p[1]) * f[0];
        return;
      }
      case Kind::on_bar:
      case Kind::on_bar_from_ground:
      case Kind::on_bar_to_ground: {
        const S along = p[0] / p[2], across = p[1] / p[2], rest = S(1.0) - along;
        S* to = Q;
        if (kind_ != Kind::on_bar_from_ground) {
          Q[0] += rest * f[0] - across * f[1];
          Q[1] += across * f[0] + rest * f[1];
          to += 2;
        }
        if (kind_ != Kind::on_bar_to_ground) {
          to[0] += along * f[0] + across * f[1];
          to[1] += along * f[1] - across * f[0];
        }
        return;
      }
    }
  }

  /// r_q.
  void jacobian(const double* q, const double* p, Eigen::Ref<Jacobian> J) const {
    J.setZero();
    switch (kind_) {
      case Kind::ground:
        return;
      case Kind::free:
        J(0, 0) = J(1, 1) = 1;
        return;
      case Kind::on_body: {
        const double c = std::cos(q[2]), s = std::sin(q[2]);
        J(0, 0) = J(1, 1) = 1;
        J(0, 2) = -s * p[0] - c * p[1];
        J(1, 2) = c * p[0] - s * p[1];
        return;
      }
      case Kind::on_bar: {
        const double f = p[0] / p[2], g = p[1] / p[2];
        J << 1 - f, g, f, -g, -g, 1 - f, g, f;
        return;
      }
      case Kind::on_bar_from_ground: {
        const double f = p[0] / p[2], g = p[1] / p[2];
        J << f, -g, g, f;
        return;
      }
      case Kind::on_bar_to_ground: {
        const double f = p[0] / p[2], g = p[1] / p[2];
        J << 1 - f, g, -g, 1 - f;
        return;
      }
    }
  }

  /// rdot_q = (r_q v)_q; zero unless the point is on a rigid body.
  void jacobian_dot(const double* q, const double* v, const double* p, Eigen::Ref<Jacobian> J) const {
    J.setZero();
    if (kind_ != Kind::on_body) return;
    const double c = std::cos(q[2]), s = std::sin(q[2]);
    J(0, 2) = -v[2] * (c * p[0] - s * p[1]);
    J(1, 2) = -v[2] * (s * p[0] + c * p[1]);
  }

  /// rddot_q at fixed v, a.
  void acceleration_partial(const double* q, const double* v, const double* a, const double* p,
                            Eigen::Ref<Jacobian> J) const {
    J.setZero();
    if (kind_ != Kind::on_body) return;
    const double c = std::cos(q[2]), s = std::sin(q[2]);
    const double rx = c * p[0] - s * p[1], ry = s * p[0] + c * p[1];
    J(0, 2) = -a[2] * rx + v[2] * v[2] * ry;
    J(1, 2) = -a[2] * ry - v[2] * v[2] * rx;
  }

  /// The only entry of (r_q^T f)_q that is not zero, at (angle, angle) of a point on a rigid body.
  double curvature(const double* q, const double* p, const Vector& f) const {
    if (kind_ != Kind::on_body) return 0;
    const double c = std::cos(q[2]), s = std::sin(q[2]);
    return -(c * p[0] - s * p[1]) * f[0] - (s * p[0] + c * p[1]) * f[1];
  }
  static constexpr int curvature_index = 2;

 private:
  /// The point p[0] along and p[1] across the line from i to j, in units of the length p[2].
  template <class S>
  static void between(const S* i, const S* j, const S* p, S& x, S& y) {
    const S along = p[0] / p[2], across = p[1] / p[2];
    const S dx = j[0] - i[0], dy = j[1] - i[1];
    x = i[0] + along * dx - across * dy;
    y = i[1] + along * dy + across * dx;
  }

  Kind kind_;
  std::string name_;
  std::vector<int> coordinates_, numbers_;
};

}  // namespace costate
