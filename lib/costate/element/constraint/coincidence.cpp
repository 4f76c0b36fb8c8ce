#include "costate/element/constraint/coincidence.h"

namespace costate {

CoincidenceConstraint::CoincidenceConstraint(std::string kind, std::string name, PlanarVector d)
    : ConstraintOf(std::move(kind), std::move(name)), d_(std::move(d)) {
  append_coordinates(d_.coordinates());
  append_numbers(d_.numbers());
}

void CoincidenceConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const { phi_q = d_.jacobian(s.q, s.p); }

void CoincidenceConstraint::calc_bias(const LocalState& s, double* bias) const {
  const double zero[PlanarVector::kMax] = {};
  const auto a = d_.acceleration(s.q, s.v, zero, s.p);
  bias[0] = a[0];
  bias[1] = a[1];
}

void CoincidenceConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  d_.add_curvature(s.q, s.p, Eigen::Vector2d(s.lambda[0], s.lambda[1]), hessian);
}

void CoincidenceConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                          LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  phid_q = d_.jacobian_dot(s.q, s.v, s.p);
  phidd_q = d_.acceleration_partial(s.q, s.v, s.a, s.p);
}

}  // namespace costate
