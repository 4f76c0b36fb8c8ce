#include "costate/element/constraint/directions.h"

#include <cmath>

namespace costate {

/// The components of all rows as vectors.
struct DirectionsConstraint::Pairs {
  Vector3 s[3], t[3];
  Pairs(const DirectionsConstraint& c, const double* p) {
    double a[3][3], b[3][3];
    c.components(p, a, b);
    for (int k = 0; k < c.rows(); ++k) {
      s[k] = Vector3(a[k]);
      t[k] = Vector3(b[k]);
    }
  }
};

DirectionsConstraint::DirectionsConstraint(std::string kind, std::string name, Condition condition, BodyDirection i,
                                           BodyDirection j, const std::vector<int>& numbers, const Vector3& first_axis)
    : ConstraintOf(std::move(kind), std::move(name)),
      condition_(condition),
      i_(std::move(i)),
      j_(std::move(j)),
      across_(coordinate_across(first_axis)) {
  append_coordinates(i_.coordinates());
  append_coordinates(j_.coordinates());
  append_numbers(numbers);
}

std::string DirectionsConstraint::row_name(int i) const {
  if (condition_ == Condition::perpendicular) return "perpendicular";
  return i == 0 ? "tilt_1" : i == 1 ? "tilt_2" : "turn";
}

template <class S>
S DirectionsConstraint::measured(int i, const MeasureArgumentsOf<S>& x) const {
  // -(u.w)_theta: what turns the first body's u towards w.
  S s[3][3], t[3][3], sum(0.0);
  components(x.p, s, t);
  for (int k = 0; k < rows(); ++k) {
    S u[3], w[3], across[3];
    i_.value(x.q, s[k], u);
    j_.value(x.q + i_.size(), t[k], w);
    cross3(u, w, across);
    sum -= x.lambda[k] * across[i];
  }
  return sum;
}

PathDual DirectionsConstraint::measure(int i, const MeasureArguments& x) const { return measured(i, x); }

bool DirectionsConstraint::measure_value(int i, const ValueArguments& x, double& value) const {
  value = measured(i, x);
  return true;
}

void DirectionsConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  const Pairs c(*this, s.p);
  const int n = i_.size();
  for (int k = 0; k < rows(); ++k) {
    phi_q.row(k).head(n) = j_.value(s.q + n, c.t[k]).transpose() * i_.jacobian(s.q, c.s[k]);
    phi_q.row(k).tail(j_.size()) = i_.value(s.q, c.s[k]).transpose() * j_.jacobian(s.q + n, c.t[k]);
  }
}

void DirectionsConstraint::calc_bias(const LocalState& s, double* bias) const {
  // (u.w)'' = u''.w + 2 u'.w' + u.w'', at a = 0.
  const Pairs c(*this, s.p);
  const int n = i_.size();
  for (int k = 0; k < rows(); ++k)
    bias[k] = i_.turning(s.v, c.s[k]).dot(j_.value(s.q + n, c.t[k])) +
              2 * i_.rate(s.q, s.v, c.s[k]).dot(j_.rate(s.q + n, s.v + n, c.t[k])) +
              i_.value(s.q, c.s[k]).dot(j_.turning(s.v + n, c.t[k]));
}

void DirectionsConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  // (u.w)_qq: K(s_i, w), u_q^T w_q, K(s_j, u).
  const Pairs c(*this, s.p);
  const int n = i_.size(), m = j_.size();
  for (int k = 0; k < rows(); ++k) {
    const double f = s.lambda[k];
    i_.add_curvature(f, c.s[k], j_.value(s.q + n, c.t[k]), 0, hessian);
    j_.add_curvature(f, c.t[k], i_.value(s.q, c.s[k]), n, hessian);
    if (n == 0 || m == 0) continue;
    const BodyDirection::Square mixed = f * i_.jacobian(s.q, c.s[k]).transpose() * j_.jacobian(s.q + n, c.t[k]);
    hessian.topRightCorner(n, m) += mixed;
    hessian.bottomLeftCorner(m, n) += mixed.transpose();
  }
}

void DirectionsConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                         LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  const Pairs c(*this, s.p);
  const int n = i_.size(), m = j_.size();
  for (int k = 0; k < rows(); ++k) {
    const Vector3 u = i_.value(s.q, c.s[k]), w = j_.value(s.q + n, c.t[k]);
    const Vector3 uv = i_.rate(s.q, s.v, c.s[k]), wv = j_.rate(s.q + n, s.v + n, c.t[k]);
    const Vector3 ua = i_.rate(s.q, s.a, c.s[k]) + i_.turning(s.v, c.s[k]);
    const Vector3 wa = j_.rate(s.q + n, s.a + n, c.t[k]) + j_.turning(s.v + n, c.t[k]);
    const auto Bi = i_.jacobian(s.q, c.s[k]), Biv = i_.jacobian_dot(s.v, c.s[k]), Bia = i_.jacobian_dot(s.a, c.s[k]);
    const auto Bj = j_.jacobian(s.q + n, c.t[k]), Bjv = j_.jacobian_dot(s.v + n, c.t[k]),
               Bja = j_.jacobian_dot(s.a + n, c.t[k]);
    phid_q.row(k).head(n) = w.transpose() * Biv + wv.transpose() * Bi;
    phid_q.row(k).tail(m) = u.transpose() * Bjv + uv.transpose() * Bj;
    phidd_q.row(k).head(n) = w.transpose() * Bia + 2 * wv.transpose() * Biv + wa.transpose() * Bi;
    phidd_q.row(k).tail(m) = u.transpose() * Bja + 2 * uv.transpose() * Bjv + ua.transpose() * Bj;
  }
}

double DirectionsConstraint::agreement(const double* q, const double* p) const {
  const auto cosine = [&](const double* s, const double* t) {
    double u[3], w[3];
    i_.value(q, s, u);
    j_.value(q + i_.size(), t, w);
    return dot3(u, w) / std::sqrt(dot3(u, u) * dot3(w, w));
  };
  double least = cosine(p, p + 3);
  if (condition_ == Condition::aligned) {
    double s[3], t[3];
    cross3(p, p + 6, s);
    cross3(p + 3, p + 9, t);
    least = std::min(least, cosine(s, t));
  }
  return least;
}

}  // namespace costate
