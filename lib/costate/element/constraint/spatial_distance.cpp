#include "costate/element/constraint/spatial_distance.h"

#include "costate/element/point/number_gradient.h"

namespace costate {

SpatialDistanceConstraint::SpatialDistanceConstraint(std::string kind, std::string name, SpatialVector d,
                                                     int length_number)
    : ConstraintOf(std::move(kind), std::move(name)), d_(std::move(d)) {
  append_coordinates(d_.coordinates());
  append_numbers({length_number});
  append_numbers(d_.numbers());
}

void SpatialDistanceConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  Vector3 d;
  d_.value(s.q, s.p + 1, d.data());
  phi_q.noalias() = 2 * d.transpose() * d_.jacobian(s.q, s.p + 1);
}

void SpatialDistanceConstraint::calc_bias(const LocalState& s, double* bias) const {
  const double zero[SpatialVector::kMax] = {};
  Vector3 d, dv;
  d_.value(s.q, s.p + 1, d.data());
  d_.rate(s.q, s.v, s.p + 1, dv.data());
  bias[0] = 2 * (dv.squaredNorm() + d.dot(d_.acceleration(s.q, s.v, zero, s.p + 1)));
}

void SpatialDistanceConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  Vector3 d;
  d_.value(s.q, s.p + 1, d.data());
  const auto J = d_.jacobian(s.q, s.p + 1);
  hessian.noalias() = 2 * s.lambda[0] * J.transpose() * J;
  d_.add_curvature(s.q, s.p + 1, 2 * s.lambda[0] * d, hessian);
}

void SpatialDistanceConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                              LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  Vector3 d, dv;
  d_.value(s.q, s.p + 1, d.data());
  d_.rate(s.q, s.v, s.p + 1, dv.data());
  const Vector3 da = d_.acceleration(s.q, s.v, s.a, s.p + 1);
  const auto J = d_.jacobian(s.q, s.p + 1);
  const auto Jv = d_.jacobian_dot(s.q, s.v, s.p + 1);
  phid_q.noalias() = 2 * (dv.transpose() * J + d.transpose() * Jv);
  phidd_q.noalias() = 2 * (da.transpose() * J + 2 * dv.transpose() * Jv +
                           d.transpose() * d_.acceleration_partial(s.q, s.v, s.a, s.p + 1));
}

// phi = d.d - L^2, phid = 2 d.dv, phidd = 2 (dv.dv + d.da), phi_q w = 2 d.dw: their weighted sum by d, dv, da and dw,
// and these by the points' numbers.
double SpatialDistanceConstraint::calc_number_gradient(const LocalState& s, int number,
                                                       const ConstraintWeights& w) const {
  const double w0 = w.phi[0], w1 = w.phid[0], w2 = w.phidd[0];
  const double* p = s.p + 1;
  double by_number[1 + kMaxNumbers<SpatialVector>] = {-2 * s.p[0] * w0}, *by_points = by_number + 1;
  Vector3 d, dv;
  d_.value(s.q, p, d.data());
  d_.rate(s.q, s.v, p, dv.data());
  Vector3 by_d = 2 * (w0 * d + w1 * dv + w2 * d_.acceleration(s.q, s.v, s.a, p));
  const Vector3 by_dv = 2 * (w1 * d + 2 * w2 * dv), by_da = 2 * w2 * d;
  if (w.reaction && s.lambda) {
    Vector3 dw;
    d_.rate(s.q, w.reaction, p, dw.data());
    by_d += 2 * s.lambda[0] * dw;
    const Vector3 by_dw = 2 * s.lambda[0] * d;
    add_rate_number_gradient(d_, s.q, w.reaction, p, by_dw, by_points);
  }
  add_number_gradient(d_, s.q, p, by_d, by_points);
  add_rate_number_gradient(d_, s.q, s.v, p, by_dv, by_points);
  add_acceleration_number_gradient(d_, s.q, s.v, s.a, p, by_da, by_points);
  return by_number[number];
}

}  // namespace costate
