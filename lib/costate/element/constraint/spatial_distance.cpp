#include "costate/element/constraint/spatial_distance.h"

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

}  // namespace costate
