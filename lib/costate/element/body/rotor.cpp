#include "costate/element/body/rotor.h"

namespace costate {

namespace {

/// g(x) = G(x)^T a.
Vector4 g(const double* x, const Vector3& a) { return body_rate_matrix(x).transpose() * a; }

/// The spin s and its rate s'.
struct Spin {
  Vector4 gp, gv, ga;
  double spin, rate;
  Spin(const LocalState& s, const Vector3& a)
      : gp(g(s.q, a)), gv(g(s.v, a)), ga(s.a ? g(s.a, a) : Vector4::Zero()), spin(s.v[4]), rate(s.a ? s.a[4] : 0) {
    for (int i = 0; i < 4; ++i) {
      spin += 2 * gp[i] * s.v[i];
      if (s.a) rate += 2 * gp[i] * s.a[i];
    }
  }
};

}  // namespace

Rotor::Rotor(std::string name, const std::vector<int>& euler, int angle, int inertia_number, const Vector3& axis)
    : BodyOf("rotor", std::move(name)), axis_(axis.normalized()) {
  append_coordinates(euler);
  append_coordinates({angle});
  append_numbers({inertia_number});
}

PathDual Rotor::measure(int, const MeasureArguments& x) const {
  PathDual w[3];
  const PathDual axis[3] = {PathDual(axis_[0]), PathDual(axis_[1]), PathDual(axis_[2])};
  body_rate(x.q, x.v, w);
  return x.v[4] + 2.0 * dot3(axis, w);
}

void Rotor::calc_mass(const LocalState& s, LocalMatrix& M) const {
  const double J = s.p[0];
  const Vector4 gp = g(s.q, axis_);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j <= i; ++j) M(i, j) = M(j, i) = 4 * J * gp[i] * gp[j];
  M.topRightCorner<4, 1>() = 2 * J * gp;
  M.bottomLeftCorner<1, 4>() = 2 * J * gp.transpose();
  M(4, 4) = J;
}

void Rotor::calc_force(const LocalState& s, double* Q) const {
  LocalState still = s;
  still.a = nullptr;
  const Spin x(still, axis_);
  for (int i = 0; i < 4; ++i) Q[i] = -4 * s.p[0] * x.spin * x.gv[i];
}

void Rotor::calc_partials(const LocalState& s, LocalMatrix& r_q, LocalMatrix& r_v) const {
  // g(x) = T x with T antisymmetric, so that s_p = -2 g(pd), s_pd = 2 g(p), s'_p = -2 g(pdd).
  const double J = s.p[0];
  const Spin x(s, axis_);
  const Eigen::Matrix4d T = body_moment_partial(axis_);
  r_q.topLeftCorner<4, 4>() = J * (2 * x.rate * T - 4 * x.gp * x.ga.transpose() - 8 * x.gv * x.gv.transpose());
  r_q.bottomLeftCorner<1, 4>() = -2 * J * x.ga.transpose();
  r_v.topLeftCorner<4, 4>() = J * (4 * x.spin * T + 8 * x.gv * x.gp.transpose());
  r_v.topRightCorner<4, 1>() = 4 * J * x.gv;
}

void Rotor::calc_number_partial(const LocalState& s, int, double* r_p) const {
  const Spin x(s, axis_);
  for (int i = 0; i < 4; ++i) r_p[i] = 2 * x.rate * x.gp[i] + 4 * x.spin * x.gv[i];
  r_p[4] = x.rate;
}

}  // namespace costate
