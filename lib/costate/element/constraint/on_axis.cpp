#include "costate/element/constraint/on_axis.h"

namespace costate {

namespace {
struct Pair {
  Vector3 b[2];
  Pair(const double* axis, int k) { perpendicular_pair(axis, k, b[0].data(), b[1].data()); }
};
}  // namespace

OnAxisConstraint::OnAxisConstraint(std::string kind, std::string name, SpatialVector d,
                                   const std::vector<int>& axis_numbers, const Vector3& first_axis)
    : ConstraintOf(std::move(kind), std::move(name)),
      d_(std::move(d)),
      u_(d_.from().rotation_coordinates()),
      rotation_(u_.size() > 0 ? SpatialPoint::curvature_index : 0),
      flattest_(flattest(first_axis)) {
  append_coordinates(d_.coordinates());
  append_numbers(axis_numbers);
  append_numbers(d_.numbers());
}

PathDual OnAxisConstraint::measure(int, const MeasureArguments& x) const {
  using std::sqrt;
  PathDual d[3], u[3];
  d_.value(x.q, x.p + 3, d);
  u_.value(x.q + rotation_, x.p, u);
  return dot3(u, d) / sqrt(dot3(x.p, x.p));
}

void OnAxisConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  const Pair c(s.p, flattest_);
  Vector3 d;
  d_.value(s.q, s.p + 3, d.data());
  const auto J = d_.jacobian(s.q, s.p + 3);
  const double* e = s.q + rotation_;
  for (int k = 0; k < 2; ++k) {
    phi_q.row(k) = u_.value(e, c.b[k]).transpose() * J;
    phi_q.row(k).segment(rotation_, u_.size()) += d.transpose() * u_.jacobian(e, c.b[k]);
  }
}

void OnAxisConstraint::calc_bias(const LocalState& s, double* bias) const {
  const Pair c(s.p, flattest_);
  const double zero[SpatialVector::kMax] = {};
  const double *e = s.q + rotation_, *ev = s.v + rotation_;
  Vector3 d, dv;
  d_.value(s.q, s.p + 3, d.data());
  d_.rate(s.q, s.v, s.p + 3, dv.data());
  const Vector3 da = d_.acceleration(s.q, s.v, zero, s.p + 3);
  for (int k = 0; k < 2; ++k)
    bias[k] =
        u_.rate(ev, ev, c.b[k]).dot(d) + 2 * u_.rate(e, ev, c.b[k]).dot(dv) + u_.value(e, c.b[k]).dot(da);
}

void OnAxisConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  const Pair c(s.p, flattest_);
  const double* e = s.q + rotation_;
  const int n = u_.size();
  Vector3 d;
  d_.value(s.q, s.p + 3, d.data());
  const auto J = d_.jacobian(s.q, s.p + 3);
  for (int k = 0; k < 2; ++k) {
    const double f = s.lambda[k];
    d_.add_curvature(s.q, s.p + 3, f * u_.value(e, c.b[k]), hessian);
    if (n == 0) continue;
    hessian.block(rotation_, rotation_, n, n) += f * rotation_curvature(c.b[k], d);
    const Eigen::Matrix<double, 4, Eigen::Dynamic, Eigen::ColMajor, 4, SpatialVector::kMax> mixed =
        f * u_.jacobian(e, c.b[k]).transpose() * J;
    hessian.middleRows(rotation_, n) += mixed;
    hessian.middleCols(rotation_, n) += mixed.transpose();
  }
}

void OnAxisConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                     LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  const Pair c(s.p, flattest_);
  const double *e = s.q + rotation_, *ev = s.v + rotation_, *ea = s.a + rotation_;
  const int n = u_.size();
  Vector3 d, dv;
  d_.value(s.q, s.p + 3, d.data());
  d_.rate(s.q, s.v, s.p + 3, dv.data());
  const Vector3 da = d_.acceleration(s.q, s.v, s.a, s.p + 3);
  const auto J = d_.jacobian(s.q, s.p + 3), Jv = d_.jacobian_dot(s.q, s.v, s.p + 3),
             Ja = d_.acceleration_partial(s.q, s.v, s.a, s.p + 3);
  for (int k = 0; k < 2; ++k) {
    const Vector3 u = u_.value(e, c.b[k]), uv = u_.rate(e, ev, c.b[k]);
    const Vector3 ua = u_.rate(e, ea, c.b[k]) + u_.rate(ev, ev, c.b[k]);
    phid_q.row(k) = u.transpose() * Jv + uv.transpose() * J;
    phidd_q.row(k) = u.transpose() * Ja + 2 * uv.transpose() * Jv + ua.transpose() * J;
    const auto B = u_.jacobian(e, c.b[k]), Bv = u_.jacobian(ev, c.b[k]), Ba = u_.jacobian(ea, c.b[k]);
    phid_q.row(k).segment(rotation_, n) += d.transpose() * Bv + dv.transpose() * B;
    phidd_q.row(k).segment(rotation_, n) += d.transpose() * Ba + 2 * dv.transpose() * Bv + da.transpose() * B;
  }
}

}  // namespace costate
