#include "costate/element/constraint/two_vectors.h"

namespace costate {

namespace {
using Vector = Eigen::Vector2d;
Vector value(const PlanarVector& d, const double* q, const double* p) {
  Vector r;
  d.value(q, p, r.data());
  return r;
}
Vector rate(const PlanarVector& d, const double* q, const double* v, const double* p) {
  Vector r;
  d.rate(q, v, p, r.data());
  return r;
}
}  // namespace

TwoVectorConstraint::TwoVectorConstraint(std::string kind, std::string name, Condition condition, PlanarVector u,
                                         PlanarVector w)
    : ConstraintOf(std::move(kind), std::move(name)), condition_(condition), u_(std::move(u)), w_(std::move(w)) {
  append_coordinates(u_.coordinates());
  append_coordinates(w_.coordinates());
  append_numbers(u_.numbers());
  append_numbers(w_.numbers());
}

Eigen::Matrix2d TwoVectorConstraint::T() const {
  Eigen::Matrix2d T = Eigen::Matrix2d::Identity();
  if (condition_ == Condition::parallel) T << 0, 1, -1, 0;
  return T;
}

void TwoVectorConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  const int n = u_.size();
  const double *qw = s.q + n, *pw = s.p + u_.number_count();
  phi_q.leftCols(n).noalias() = (T() * value(w_, qw, pw)).transpose() * u_.jacobian(s.q, s.p);
  phi_q.rightCols(w_.size()).noalias() = (T().transpose() * value(u_, s.q, s.p)).transpose() * w_.jacobian(qw, pw);
}

void TwoVectorConstraint::calc_bias(const LocalState& s, double* bias) const {
  const int n = u_.size();
  const double *qw = s.q + n, *vw = s.v + n, *pw = s.p + u_.number_count();
  const double zero[PlanarVector::kMax] = {};
  const Vector u = value(u_, s.q, s.p), w = value(w_, qw, pw);
  bias[0] = 2 * rate(u_, s.q, s.v, s.p).dot(T() * rate(w_, qw, vw, pw)) +
            u_.acceleration(s.q, s.v, zero, s.p).dot(T() * w) + u.dot(T() * w_.acceleration(qw, vw, zero, pw));
}

void TwoVectorConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  const int n = u_.size(), k = w_.size();
  const double *qw = s.q + n, *pw = s.p + u_.number_count();
  const Vector u = value(u_, s.q, s.p), w = value(w_, qw, pw);
  const double l = s.lambda[0];
  hessian.topRightCorner(n, k).noalias() = l * u_.jacobian(s.q, s.p).transpose() * T() * w_.jacobian(qw, pw);
  hessian.bottomLeftCorner(k, n) = hessian.topRightCorner(n, k).transpose();
  u_.add_curvature(s.q, s.p, l * T() * w, hessian);
  w_.add_curvature(qw, pw, l * T().transpose() * u, hessian, n);
}

void TwoVectorConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                        LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  const int n = u_.size(), k = w_.size();
  const double *qw = s.q + n, *vw = s.v + n, *aw = s.a + n, *pw = s.p + u_.number_count();
  const Vector u = T().transpose() * value(u_, s.q, s.p), w = T() * value(w_, qw, pw);
  const Vector ud = T().transpose() * rate(u_, s.q, s.v, s.p), wd = T() * rate(w_, qw, vw, pw);
  const Vector udd = T().transpose() * u_.acceleration(s.q, s.v, s.a, s.p);
  const Vector wdd = T() * w_.acceleration(qw, vw, aw, pw);
  const auto Ju = u_.jacobian(s.q, s.p), Jw = w_.jacobian(qw, pw);
  const auto Jud = u_.jacobian_dot(s.q, s.v, s.p), Jwd = w_.jacobian_dot(qw, vw, pw);
  phid_q.leftCols(n).noalias() = wd.transpose() * Ju + w.transpose() * Jud;
  phid_q.rightCols(k).noalias() = ud.transpose() * Jw + u.transpose() * Jwd;
  phidd_q.leftCols(n).noalias() =
      wdd.transpose() * Ju + 2 * wd.transpose() * Jud + w.transpose() * u_.acceleration_partial(s.q, s.v, s.a, s.p);
  phidd_q.rightCols(k).noalias() =
      udd.transpose() * Jw + 2 * ud.transpose() * Jwd + u.transpose() * w_.acceleration_partial(qw, vw, aw, pw);
}

}  // namespace costate
