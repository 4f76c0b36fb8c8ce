#include "costate/element/constraint/prismatic.h"

#include "costate/base/error.h"

namespace costate {

namespace {
using Vector = Eigen::Vector2d;
}

/// n and e = (cos theta, sin theta) with n' = -e, e' = n, and the rates of theta.
struct PrismaticConstraint::Frame {
  Vector n, e;
  double w, alpha;
  Frame(const PrismaticConstraint& c, const LocalState& s) {
    const double theta = c.angle_i(s.q) + s.p[0];
    e = {std::cos(theta), std::sin(theta)};
    n = {-e[1], e[0]};
    w = s.v && c.i_ >= 0 ? s.v[c.i_] : 0;
    alpha = s.a && c.i_ >= 0 ? s.a[c.i_] : 0;
  }
};

PrismaticConstraint::PrismaticConstraint(std::string kind, std::string name, PlanarVector d, int axis_number,
                                         int relative_number)
    : ConstraintOf(std::move(kind), std::move(name)), d_(std::move(d)) {
  const auto angle = [&](const PlanarPoint& p, int offset) {
    if (p.kind() == PlanarPoint::Kind::ground) return -1;
    if (p.kind() == PlanarPoint::Kind::on_body) return offset + 2;
    throw ModelError(path(), "A prismatic joint needs points on bodies or on the ground, but '" + p.name() +
                                 "' is neither. For points on bars there are [slot.*] and [parallel.*].");
  };
  i_ = angle(d_.from(), 0);
  j_ = angle(d_.to(), d_.from().size());
  if (i_ >= 0 && j_ >= 0 && d_.from().coordinates() == d_.to().coordinates())
    throw ModelError(path(), "The two points of a prismatic joint must be on different bodies.");
  append_coordinates(d_.coordinates());
  append_numbers({axis_number, relative_number});
  append_numbers(d_.numbers());
}

PathDual PrismaticConstraint::measure(int i, const MeasureArguments& x) const {
  if (i > 0) return x.lambda[i - 1];
  PathDual d[2];
  d_.value(x.q, x.p + 2, d);
  const PathDual theta = angle_i(x.q) + x.p[0];
  return cos(theta) * d[0] + sin(theta) * d[1];
}

void PrismaticConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  const Frame f(*this, s);
  Vector d;
  d_.value(s.q, s.p + 2, d.data());
  phi_q.row(1).noalias() = f.n.transpose() * d_.jacobian(s.q, s.p + 2);
  if (j_ >= 0) phi_q(0, j_) = 1;
  if (i_ < 0) return;
  phi_q(0, i_) = -1;
  phi_q(1, i_) -= f.e.dot(d);
}

void PrismaticConstraint::calc_bias(const LocalState& s, double* bias) const {
  const Frame f(*this, s);
  const double zero[PlanarVector::kMax] = {};
  Vector d, dv;
  d_.value(s.q, s.p + 2, d.data());
  d_.rate(s.q, s.v, s.p + 2, dv.data());
  bias[0] = 0;
  bias[1] = f.n.dot(d_.acceleration(s.q, s.v, zero, s.p + 2)) - 2 * f.w * f.e.dot(dv) - f.w * f.w * f.n.dot(d);
}

void PrismaticConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  const Frame f(*this, s);
  const double l = s.lambda[1];
  d_.add_curvature(s.q, s.p + 2, l * f.n, hessian);
  if (i_ < 0) return;
  Vector d;
  d_.value(s.q, s.p + 2, d.data());
  const Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, PlanarVector::kMax> cross =
      -l * f.e.transpose() * d_.jacobian(s.q, s.p + 2);
  hessian.row(i_) += cross;
  hessian.col(i_) += cross.transpose();
  hessian(i_, i_) -= l * f.n.dot(d);
}

void PrismaticConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                        LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  const Frame f(*this, s);
  const double* p = s.p + 2;
  Vector d, dv;
  d_.value(s.q, p, d.data());
  d_.rate(s.q, s.v, p, dv.data());
  const Vector da = d_.acceleration(s.q, s.v, s.a, p);
  const auto J = d_.jacobian(s.q, p), Jv = d_.jacobian_dot(s.q, s.v, p);
  const Vector nd = -f.w * f.e, ndd = -f.alpha * f.e - f.w * f.w * f.n;
  phid_q.row(1).noalias() = f.n.transpose() * Jv + nd.transpose() * J;
  phidd_q.row(1).noalias() =
      f.n.transpose() * d_.acceleration_partial(s.q, s.v, s.a, p) + 2 * nd.transpose() * Jv + ndd.transpose() * J;
  if (i_ < 0) return;
  phid_q(1, i_) += -f.e.dot(dv) - f.w * f.n.dot(d);
  phidd_q(1, i_) += -f.e.dot(da) - 2 * f.w * f.n.dot(dv) + (f.w * f.w * f.e - f.alpha * f.n).dot(d);
}

}  // namespace costate
