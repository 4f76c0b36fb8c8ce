#include "costate/element/constraint/spatial_coincidence.h"

#include "costate/element/point/number_gradient.h"

namespace costate {

SpatialCoincidenceConstraint::SpatialCoincidenceConstraint(std::string kind, std::string name, SpatialVector d)
    : ConstraintOf(std::move(kind), std::move(name)), d_(std::move(d)) {
  append_coordinates(d_.coordinates());
  append_numbers(d_.numbers());
}

void SpatialCoincidenceConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  phi_q = d_.jacobian(s.q, s.p);
}

void SpatialCoincidenceConstraint::calc_bias(const LocalState& s, double* bias) const {
  const double zero[SpatialVector::kMax] = {};
  Eigen::Map<Vector3>(bias, 3) = d_.acceleration(s.q, s.v, zero, s.p);
}

void SpatialCoincidenceConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  d_.add_curvature(s.q, s.p, Vector3(s.lambda), hessian);
}

void SpatialCoincidenceConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                                 LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  phid_q = d_.jacobian_dot(s.q, s.v, s.p);
  phidd_q = d_.acceleration_partial(s.q, s.v, s.a, s.p);
}

double SpatialCoincidenceConstraint::calc_number_gradient(const LocalState& s, int number,
                                                          const ConstraintWeights& w) const {
  double by_number[kMaxNumbers<SpatialVector>] = {};
  add_number_gradient(d_, s.q, s.p, Vector3(w.phi), by_number);
  add_rate_number_gradient(d_, s.q, s.v, s.p, Vector3(w.phid), by_number);
  add_acceleration_number_gradient(d_, s.q, s.v, s.a, s.p, Vector3(w.phidd), by_number);
  if (w.reaction && s.lambda) add_rate_number_gradient(d_, s.q, w.reaction, s.p, Vector3(s.lambda), by_number);
  return by_number[number];
}

}  // namespace costate
