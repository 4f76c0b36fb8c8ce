#include "costate/element/constraint/distance.h"

namespace costate {

namespace {
bool is_plain(const PlanarPoint& p) {
  return p.kind() == PlanarPoint::Kind::free || p.kind() == PlanarPoint::Kind::ground;
}
/// row = 2 c d^T d_q for points with unit Jacobians: -2 c d at i, +2 c d at j.
void set_plain_row(const PlanarVector& v, const double* d, double factor, LocalMatrix& row) {
  int k = 0;
  if (v.from().size() > 0) {
    row(0, 0) = -factor * d[0];
    row(0, 1) = -factor * d[1];
    k = 2;
  }
  if (v.to().size() > 0) {
    row(0, k) = factor * d[0];
    row(0, k + 1) = factor * d[1];
  }
}
}  // namespace

DistanceConstraint::DistanceConstraint(std::string kind, std::string name, PlanarVector d, int length_number)
    : ConstraintOf(std::move(kind), std::move(name)),
      d_(std::move(d)),
      linear_(is_plain(d_.from()) && is_plain(d_.to())) {
  append_coordinates(d_.coordinates());
  append_numbers({length_number});
  append_numbers(d_.numbers());
}

void DistanceConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  double d[2];
  d_.value(s.q, s.p + 1, d);
  if (linear_) return set_plain_row(d_, d, 2, phi_q);
  phi_q.noalias() = 2 * Eigen::RowVector2d(d[0], d[1]) * d_.jacobian(s.q, s.p + 1);
}

void DistanceConstraint::calc_bias(const LocalState& s, double* bias) const {
  double d[2], dv[2];
  d_.value(s.q, s.p + 1, d);
  d_.rate(s.q, s.v, s.p + 1, dv);
  bias[0] = 2 * (dv[0] * dv[0] + dv[1] * dv[1]);
  if (linear_) return;
  const double zero[PlanarVector::kMax] = {};
  const auto da = d_.acceleration(s.q, s.v, zero, s.p + 1);
  bias[0] += 2 * (d[0] * da[0] + d[1] * da[1]);
}

void DistanceConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  if (linear_) {
    const double h = 2 * s.lambda[0];
    const int n = d_.size();
    for (int i = 0; i < n; ++i) hessian(i, i) = h;
    if (n == 4) hessian(0, 2) = hessian(2, 0) = hessian(1, 3) = hessian(3, 1) = -h;
    return;
  }
  double d[2];
  d_.value(s.q, s.p + 1, d);
  const auto J = d_.jacobian(s.q, s.p + 1);
  hessian.noalias() = 2 * s.lambda[0] * J.transpose() * J;
  d_.add_curvature(s.q, s.p + 1, 2 * s.lambda[0] * Eigen::Vector2d(d[0], d[1]), hessian);
}

void DistanceConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                       LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  double d[2], dv[2];
  d_.rate(s.q, s.v, s.p + 1, dv);
  if (linear_) {
    double da[2];
    d_.rate(s.q, s.a, s.p + 1, da);
    set_plain_row(d_, dv, 2, phid_q);
    set_plain_row(d_, da, 2, phidd_q);
    return;
  }
  d_.value(s.q, s.p + 1, d);
  const Eigen::RowVector2d r(d[0], d[1]), rv(dv[0], dv[1]);
  const Eigen::RowVector2d ra = d_.acceleration(s.q, s.v, s.a, s.p + 1).transpose();
  const auto J = d_.jacobian(s.q, s.p + 1);
  const auto Jv = d_.jacobian_dot(s.q, s.v, s.p + 1);
  phid_q.noalias() = 2 * (rv * J + r * Jv);
  phidd_q.noalias() = 2 * (ra * J + 2 * rv * Jv + r * d_.acceleration_partial(s.q, s.v, s.a, s.p + 1));
}

void DistanceConstraint::calc_number_partial(const LocalState& s, int number, double* phi_p, double* phid_p,
                                             double* phidd_p, double* reaction_p) const {
  if (number != 0) return Constraint::calc_number_partial(s, number, phi_p, phid_p, phidd_p, reaction_p);
  phi_p[0] = -2 * s.p[0];
}

double DistanceConstraint::calc_number_gradient(const LocalState& s, int number, const ConstraintWeights& w) const {
  if (number != 0) return Constraint::calc_number_gradient(s, number, w);
  return -2 * s.p[0] * w.phi[0];
}

}  // namespace costate
