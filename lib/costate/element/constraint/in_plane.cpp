#include "costate/element/constraint/in_plane.h"

namespace costate {

InPlaneConstraint::InPlaneConstraint(std::string kind, std::string name, SpatialVector d,
                                     const std::vector<int>& normal_numbers)
    : ConstraintOf(std::move(kind), std::move(name)),
      d_(std::move(d)),
      u_(d_.from().rotation_coordinates()),
      rotation_(u_.size() > 0 ? SpatialPoint::curvature_index : 0) {
  append_coordinates(d_.coordinates());
  append_numbers(normal_numbers);
  append_numbers(d_.numbers());
}

void InPlaneConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  const Vector3 n(s.p);
  const double* e = s.q + rotation_;
  Vector3 d;
  d_.value(s.q, s.p + 3, d.data());
  phi_q.noalias() = u_.value(e, n).transpose() * d_.jacobian(s.q, s.p + 3);
  phi_q.row(0).segment(rotation_, u_.size()) += d.transpose() * u_.jacobian(e, n);
}

void InPlaneConstraint::calc_bias(const LocalState& s, double* bias) const {
  const Vector3 n(s.p);
  const double zero[SpatialVector::kMax] = {};
  const double *e = s.q + rotation_, *ev = s.v + rotation_;
  Vector3 d, dv;
  d_.value(s.q, s.p + 3, d.data());
  d_.rate(s.q, s.v, s.p + 3, dv.data());
  bias[0] = u_.rate(ev, ev, n).dot(d) + 2 * u_.rate(e, ev, n).dot(dv) +
            u_.value(e, n).dot(d_.acceleration(s.q, s.v, zero, s.p + 3));
}

void InPlaneConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  const Vector3 n(s.p);
  const double *e = s.q + rotation_, f = s.lambda[0];
  const int size = u_.size();
  d_.add_curvature(s.q, s.p + 3, f * u_.value(e, n), hessian);
  if (size == 0) return;
  Vector3 d;
  d_.value(s.q, s.p + 3, d.data());
  hessian.block(rotation_, rotation_, size, size) += f * rotation_curvature(n, d);
  const Eigen::Matrix<double, 4, Eigen::Dynamic, Eigen::ColMajor, 4, SpatialVector::kMax> mixed =
      f * u_.jacobian(e, n).transpose() * d_.jacobian(s.q, s.p + 3);
  hessian.middleRows(rotation_, size) += mixed;
  hessian.middleCols(rotation_, size) += mixed.transpose();
}

void InPlaneConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                      LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  const Vector3 n(s.p);
  const double *e = s.q + rotation_, *ev = s.v + rotation_, *ea = s.a + rotation_;
  Vector3 d, dv;
  d_.value(s.q, s.p + 3, d.data());
  d_.rate(s.q, s.v, s.p + 3, dv.data());
  const Vector3 da = d_.acceleration(s.q, s.v, s.a, s.p + 3);
  const Vector3 u = u_.value(e, n), uv = u_.rate(e, ev, n), ua = u_.rate(e, ea, n) + u_.rate(ev, ev, n);
  const auto J = d_.jacobian(s.q, s.p + 3), Jv = d_.jacobian_dot(s.q, s.v, s.p + 3),
             Ja = d_.acceleration_partial(s.q, s.v, s.a, s.p + 3);
  phid_q.noalias() = u.transpose() * Jv + uv.transpose() * J;
  phidd_q.noalias() = u.transpose() * Ja + 2 * uv.transpose() * Jv + ua.transpose() * J;
  const auto B = u_.jacobian(e, n), Bv = u_.jacobian(ev, n), Ba = u_.jacobian(ea, n);
  phid_q.row(0).segment(rotation_, u_.size()) += d.transpose() * Bv + dv.transpose() * B;
  phidd_q.row(0).segment(rotation_, u_.size()) +=
      d.transpose() * Ba + 2 * dv.transpose() * Bv + da.transpose() * B;
}

}  // namespace costate
