#include "costate/element/constraint/tie_rod.h"

namespace costate {

TieRodConstraint::TieRodConstraint(std::string name, SpatialPoint sliding, int slide, SpatialPoint to,
                                   int length_number, const Vector3& direction)
    : ConstraintOf("tie_rod", std::move(name)),
      i_(std::move(sliding)),
      j_(std::move(to)),
      u_(i_.rotation_coordinates()),
      direction_(direction.normalized()) {
  append_coordinates(i_.coordinates());
  append_coordinates({slide});
  append_coordinates(j_.coordinates());
  append_numbers({length_number});
  append_numbers(i_.numbers());
  append_numbers(j_.numbers());
}

/// The rod's vector along the motion, and its derivatives on the local coordinates.
struct TieRodConstraint::Motion {
  Vector3 d, dv, da;  // da: with the accelerations that are handed in
  Row J, Jv, Ja;      // d_q, dv_q, da_q

  Motion(const TieRodConstraint& c, const LocalState& s, const double* a, bool with_rates) {
    const int n = c.i_.size(), r = n > 0 ? SpatialPoint::curvature_index : 0, m = c.u_.size();
    const int size = n + 1 + c.j_.size();
    const double *pi = s.p + 1, *pj = s.p + 4;
    const double *q = s.q, *v = s.v;
    const double *qj = q + n + 1, *vj = v + n + 1, *aj = a + n + 1;
    const Vector3 u = c.u_.value(q + r, c.direction_);
    Vector3 x, y;
    c.i_.position(q, pi, x.data());
    c.j_.position(qj, pj, y.data());
    d = y - x - q[n] * u;
    J.setZero(3, size);
    J.leftCols(n) = -c.i_.jacobian(q, pi);
    J.middleCols(r, m) -= q[n] * c.u_.jacobian(q + r, c.direction_);
    J.col(n) = -u;
    J.rightCols(c.j_.size()) = c.j_.jacobian(qj, pj);
    if (!with_rates) return;
    const Vector3 uv = c.u_.rate(q + r, v + r, c.direction_);
    const Vector3 ua = c.u_.rate(q + r, a + r, c.direction_) + c.u_.rate(v + r, v + r, c.direction_);
    c.i_.velocity(q, v, pi, x.data());
    c.j_.velocity(qj, vj, pj, y.data());
    dv = y - x - v[n] * u - q[n] * uv;
    c.i_.acceleration(q, v, a, pi, x.data());
    c.j_.acceleration(qj, vj, aj, pj, y.data());
    da = y - x - a[n] * u - 2 * v[n] * uv - q[n] * ua;
    Jv.setZero(3, size);
    Ja.setZero(3, size);
    Jv.leftCols(n) = -c.i_.jacobian_dot(q, v, pi);
    Ja.leftCols(n) = -c.i_.acceleration_partial(q, v, a, pi);
    Jv.rightCols(c.j_.size()) = c.j_.jacobian_dot(qj, vj, pj);
    Ja.rightCols(c.j_.size()) = c.j_.acceleration_partial(qj, vj, aj, pj);
    Jv.col(n) = -uv;
    Ja.col(n) = -ua;
    const auto B = c.u_.jacobian(q + r, c.direction_), Bv = c.u_.jacobian(v + r, c.direction_),
               Ba = c.u_.jacobian(a + r, c.direction_);
    Jv.middleCols(r, m) -= v[n] * B + q[n] * Bv;
    Ja.middleCols(r, m) -= a[n] * B + 2 * v[n] * Bv + q[n] * Ba;
  }
};

namespace {
constexpr double kRest[2 * SpatialPoint::kMaxCoordinates + 1] = {};
}

void TieRodConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  const Motion x(*this, s, kRest, false);
  phi_q.noalias() = 2 * x.d.transpose() * x.J;
}

void TieRodConstraint::calc_bias(const LocalState& s, double* bias) const {
  const Motion x(*this, s, kRest, true);
  bias[0] = 2 * (x.dv.squaredNorm() + x.d.dot(x.da));
}

void TieRodConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  const Motion x(*this, s, kRest, false);
  const int n = i_.size(), k = SpatialPoint::curvature_index;
  hessian.noalias() = 2 * s.lambda[0] * x.J.transpose() * x.J;
  const Vector3 f = 2 * s.lambda[0] * x.d;
  if (n > 0) {
    hessian.block<4, 4>(k, k) -= i_.curvature(s.p + 1, f) + s.q[n] * rotation_curvature(direction_, f);
    const Vector4 mixed = u_.jacobian(s.q + k, direction_).transpose() * f;
    hessian.block<4, 1>(k, n) -= mixed;
    hessian.block<1, 4>(n, k) -= mixed.transpose();
  }
  if (j_.kind() == SpatialPoint::Kind::on_body) hessian.block<4, 4>(n + 1 + k, n + 1 + k) += j_.curvature(s.p + 4, f);
}

void TieRodConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                     LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  const Motion x(*this, s, s.a, true);
  phid_q.noalias() = 2 * (x.dv.transpose() * x.J + x.d.transpose() * x.Jv);
  phidd_q.noalias() = 2 * (x.da.transpose() * x.J + 2 * x.dv.transpose() * x.Jv + x.d.transpose() * x.Ja);
}

}  // namespace costate
