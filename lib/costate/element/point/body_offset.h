// The component u . d of the vector d = r_j - r_i between two points of space along a direction u = A_i b
// fixed to the body of the first one, with its exact derivatives on the coordinates of d. The components b
// are handed in, in the first body's frame; p are the numbers of the points.
#pragma once

#include <utility>

#include "costate/element/point/number_gradient.h"

namespace costate {

class BodyOffset {
 public:
  using Row = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, SpatialVector::kMax>;

  explicit BodyOffset(SpatialVector d) : d_(std::move(d)), u_(d_.from().direction_coordinates()) {}

  const SpatialVector& vector() const { return d_; }
  int size() const { return d_.size(); }

  template <class S>
  S value(const S* q, const S* p, const S* b) const {
    S u[3], d[3];
    d_.value(q, p, d);
    u_.value(q + rotation, b, u);
    return dot3(u, d);
  }
  /// u.
  template <class S>
  void direction(const S* q, const S* b, S* u) const {
    u_.value(q + rotation, b, u);
  }
  Row gradient(const double* q, const double* p, const Vector3& b) const {
    Vector3 d;
    d_.value(q, p, d.data());
    const double* e = q + rotation;
    Row r = u_.value(e, b).transpose() * d_.jacobian(q, p);
    add(d, u_.jacobian(e, b), r);
    return r;
  }
  /// Second time derivative at a = 0.
  double bias(const double* q, const double* v, const double* p, const Vector3& b) const {
    const double zero[SpatialVector::kMax] = {};
    const double *e = q + rotation, *ev = v + rotation;
    Vector3 d, dv;
    d_.value(q, p, d.data());
    d_.rate(q, v, p, dv.data());
    return u_.turning(ev, b).dot(d) + 2 * u_.rate(e, ev, b).dot(dv) +
           u_.value(e, b).dot(d_.acceleration(q, v, zero, p));
  }
  /// H += factor (u . d)_qq.
  template <class Matrix>
  void add_hessian(double factor, const double* q, const double* p, const Vector3& b, Matrix& H) const {
    const double* e = q + rotation;
    const int n = u_.size();
    Vector3 d;
    d_.value(q, p, d.data());
    d_.add_curvature(q, p, factor * u_.value(e, b), H);
    if (n == 0) return;
    u_.add_curvature(factor, b, d, rotation, H);
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, BodyDirection::kMax,
                        SpatialVector::kMax>
        mixed = factor * u_.jacobian(e, b).transpose() * d_.jacobian(q, p);
    H.block(rotation, 0, n, size()) += mixed;
    H.block(0, rotation, size(), n) += mixed.transpose();
  }
  /// Partial derivatives of the first and second time derivative with respect to q at fixed v, a.
  void partials(const double* q, const double* v, const double* a, const double* p, const Vector3& b, Row& rate_q,
                Row& acceleration_q) const {
    const double *e = q + rotation, *ev = v + rotation, *ea = a + rotation;
    Vector3 d, dv;
    d_.value(q, p, d.data());
    d_.rate(q, v, p, dv.data());
    const Vector3 da = d_.acceleration(q, v, a, p);
    const auto J = d_.jacobian(q, p), Jv = d_.jacobian_dot(q, v, p), Ja = d_.acceleration_partial(q, v, a, p);
    const Vector3 u = u_.value(e, b), uv = u_.rate(e, ev, b), ua = u_.rate(e, ea, b) + u_.turning(ev, b);
    rate_q = u.transpose() * Jv + uv.transpose() * J;
    acceleration_q = u.transpose() * Ja + 2 * uv.transpose() * Jv + ua.transpose() * J;
    if (u_.size() == 0) return;
    const auto B = u_.jacobian(e, b), Bv = u_.jacobian_dot(ev, b), Ba = u_.jacobian_dot(ea, b);
    add(d, Bv, rate_q);
    add(dv, B, rate_q);
    add(d, Ba, acceleration_q);
    add(2 * dv, Bv, acceleration_q);
    add(da, B, acceleration_q);
  }
  /// The gradient of w0 x + w1 xdot + w2 xddot + c x_q w, x = u . d, with respect to the numbers of the points, added
  /// to out, and to b, returned; w may be null.
  Vector3 add_number_gradient(const double* q, const double* v, const double* a, const double weights[3],
                              const double* w, double c, const double* p, const Vector3& b, double* out) const {
    const double *e = q + rotation, *ev = v + rotation, *ea = a + rotation;
    const double w0 = weights[0], w1 = weights[1], w2 = weights[2];
    Vector3 d, dv, by_b = Vector3::Zero();
    d_.value(q, p, d.data());
    d_.rate(q, v, p, dv.data());
    const Vector3 da = d_.acceleration(q, v, a, p);
    const Vector3 u = u_.value(e, b), uv = u_.rate(e, ev, b), ua = u_.rate(e, ea, b) + u_.turning(ev, b);
    // By d and u and by their rates; x_q w is the rate along w.
    Vector3 by_d = w0 * u + w1 * uv + w2 * ua, by_u = w0 * d + w1 * dv + w2 * da;
    if (w) {
      const double* ew = w + rotation;
      Vector3 dw;
      d_.rate(q, w, p, dw.data());
      by_d += c * u_.rate(e, ew, b);
      by_u += c * dw;
      add_rate_number_gradient(d_, q, w, p, c * u, out);
      add_rate_component_gradient(u_, e, ew, c * d, by_b);
    }
    costate::add_number_gradient(d_, q, p, by_d, out);
    add_rate_number_gradient(d_, q, v, p, w1 * u + 2 * w2 * uv, out);
    add_acceleration_number_gradient(d_, q, v, a, p, w2 * u, out);
    add_component_gradient(u_, e, by_u, by_b);
    add_rate_component_gradient(u_, e, ev, w1 * d + 2 * w2 * dv, by_b);
    add_acceleration_component_gradient(u_, e, ev, ea, w2 * d, by_b);
    return by_b;
  }

 private:
  static constexpr int rotation = 3;  // local index of the first body's coordinates of rotation, if it has any

  void add(const Vector3& f, const BodyDirection::Jacobian& B, Row& row) const {
    if (u_.size() > 0) row.segment(rotation, u_.size()).noalias() += f.transpose() * B;
  }

  SpatialVector d_;
  BodyDirection u_;
};

}  // namespace costate
