#include "costate/element/constraint/bar_angle.h"

namespace costate {

namespace {
using Vector = Eigen::Vector2d;
/// n = (sin, -cos) of the angle, so that phi = n.d; n' = (cos, sin) =: e, e' = -n.
struct Frame {
  Vector n, e;
  double w, alpha;
  Frame(const LocalState& s, int k) {
    const double c = std::cos(s.q[k]), sn = std::sin(s.q[k]);
    n = {sn, -c};
    e = {c, sn};
    w = s.v ? s.v[k] : 0;
    alpha = s.a ? s.a[k] : 0;
  }
};
}  // namespace

BarAngleConstraint::BarAngleConstraint(std::string name, PlanarVector d, int angle_coordinate)
    : ConstraintOf("angle", std::move(name)), d_(std::move(d)) {
  append_coordinates(d_.coordinates());
  append_coordinates({angle_coordinate});
  append_numbers(d_.numbers());
}

void BarAngleConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  const int k = d_.size();
  const Frame f(s, k);
  Vector d;
  d_.value(s.q, s.p, d.data());
  phi_q.leftCols(k).noalias() = f.n.transpose() * d_.jacobian(s.q, s.p);
  phi_q(0, k) = f.e.dot(d);
}

void BarAngleConstraint::calc_bias(const LocalState& s, double* bias) const {
  const int k = d_.size();
  const Frame f(s, k);
  const double zero[PlanarVector::kMax] = {};
  Vector d, dv;
  d_.value(s.q, s.p, d.data());
  d_.rate(s.q, s.v, s.p, dv.data());
  bias[0] = f.n.dot(d_.acceleration(s.q, s.v, zero, s.p)) + 2 * f.w * f.e.dot(dv) - f.w * f.w * f.n.dot(d);
}

void BarAngleConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  const int k = d_.size();
  const Frame f(s, k);
  Vector d;
  d_.value(s.q, s.p, d.data());
  const double l = s.lambda[0];
  hessian.topRightCorner(k, 1).noalias() = l * d_.jacobian(s.q, s.p).transpose() * f.e;
  hessian.bottomLeftCorner(1, k) = hessian.topRightCorner(k, 1).transpose();
  hessian(k, k) = -l * f.n.dot(d);
  d_.add_curvature(s.q, s.p, l * f.n, hessian);
}

void BarAngleConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                       LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  const int k = d_.size();
  const Frame f(s, k);
  Vector d, dv;
  d_.value(s.q, s.p, d.data());
  d_.rate(s.q, s.v, s.p, dv.data());
  const Vector da = d_.acceleration(s.q, s.v, s.a, s.p);
  const auto J = d_.jacobian(s.q, s.p), Jv = d_.jacobian_dot(s.q, s.v, s.p);
  // ndot = w e, nddot = alpha e - w^2 n
  const Vector nd = f.w * f.e, ndd = f.alpha * f.e - f.w * f.w * f.n;
  phid_q.leftCols(k).noalias() = nd.transpose() * J + f.n.transpose() * Jv;
  phid_q(0, k) = f.e.dot(dv) - f.w * f.n.dot(d);
  phidd_q.leftCols(k).noalias() =
      ndd.transpose() * J + 2 * nd.transpose() * Jv + f.n.transpose() * d_.acceleration_partial(s.q, s.v, s.a, s.p);
  // phidd = n.da + 2 w e.dv + (alpha e - w^2 n).d, with de/dangle = -n, dn/dangle = e
  phidd_q(0, k) = f.e.dot(da) - 2 * f.w * f.n.dot(dv) - (f.alpha * f.n + f.w * f.w * f.e).dot(d);
}

}  // namespace costate
