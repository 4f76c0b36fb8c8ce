#include "costate/adjoint/known_instant.h"

namespace costate {

namespace {
using Eigen::Map;
using Eigen::VectorXd;
}  // namespace

KnownInstant::Multipliers KnownInstant::solve(VectorXd right) {
  balance_.solve(right.data());
  return {right.head(assembly_.n()), right.tail(assembly_.m())};
}

void KnownInstant::prepare(const StateView& before, double behind) {
  const int n = assembly_.n(), m = assembly_.m();
  before_ = behind_ = before;
  behind_.t = behind;
  assembly_.calc_constraints(before_);
  VectorXd right = VectorXd::Zero(n + m);
  right.tail(m) = Map<const VectorXd>(assembly_.phi_t.data(), m);
  balance_.prepare(behind_);
  right.tail(m) -= Map<const VectorXd>(assembly_.phi_t.data(), m);
  const Multipliers x = solve(right);
  u_ = x.a;
  P_ = x.b;
  v_behind_ = Map<const VectorXd>(before.v, n) + u_;
}

KnownInstant::Multipliers KnownInstant::changes(const Variation& d) {
  const int n = assembly_.n(), m = assembly_.m();
  VectorXd right = VectorXd::Zero(n + m), earlier = VectorXd::Zero(m);
  subtract_mass_change(assembly_, behind_, d, u_, right.data());
  subtract_row_change(assembly_, behind_, d, v_behind_, 1, right.data() + n, &P_, right.data());
  subtract_row_change(assembly_, before_, d, Map<const VectorXd>(before_.v, n), 1, earlier.data());
  right.tail(m) -= earlier;
  return solve(right);
}

VectorXd KnownInstant::change(const Variation& d) { return changes(d).a; }

ImpulseDerivatives KnownInstant::terms(const Variation& d, const Changing& a, const Changing& b, const Multipliers& du,
                                       double* q, double* rho) {
  const VectorXd v = Map<const VectorXd>(before_.v, assembly_.n()), dv = Map<const VectorXd>(d.v, assembly_.n());
  ImpulseDerivatives out{q, rho};
  add_mass_terms(assembly_, behind_, d, a, {u_, du.a}, out);
  // P^T Phi_q a, of which (P, a) change or, where a has no value, a alone.
  add_row_terms(assembly_, behind_, d, {P_, du.b}, a, 0, out);
  add_row_terms(assembly_, behind_, d, b, {v_behind_, dv + du.a}, 1, out);
  add_row_terms(assembly_, before_, d, {-b.value, -b.change}, {v, dv}, 1, out);
  return out;
}

MotionEvents::Gradient KnownInstant::transition_gradient(const double* mu) {
  const int n = assembly_.n(), m = assembly_.m();
  MotionEvents::Gradient sum{Map<const VectorXd>(mu, 2 * n + assembly_.nz()), VectorXd::Zero(assembly_.np()), 0};
  VectorXd right = VectorXd::Zero(n + m);
  right.head(n) = Map<const VectorXd>(mu + n, n);
  const Multipliers s = solve(right);
  const VectorXd still = VectorXd::Zero(2 * n + assembly_.nz());
  const std::vector<double> none(assembly_.numbers().size(), 0.0);
  const Variation d{0, still.data(), still.data(), nullptr, nullptr, still.data(), none.data()};
  sum.t = terms(d, {VectorXd::Zero(n), s.a}, {VectorXd::Zero(m), s.b}, {VectorXd::Zero(n), VectorXd::Zero(m)},
                sum.x.data(), sum.rho.data())
              .t;
  return sum;
}

MotionEvents::Gradient KnownInstant::gradient_change(const double* mu, const Variation& d) {
  const int n = assembly_.n(), m = assembly_.m();
  MotionEvents::Gradient sum{VectorXd::Zero(2 * n + assembly_.nz()), VectorXd::Zero(assembly_.np()), 0};
  VectorXd right = VectorXd::Zero(n + m);
  right.head(n) = Map<const VectorXd>(mu + n, n);
  const Multipliers s = solve(right);
  right.setZero();
  subtract_mass_change(assembly_, behind_, d, s.a, right.data());
  subtract_row_change(assembly_, behind_, d, s.a, 0, right.data() + n, &s.b, right.data());
  const Multipliers ds = solve(right);
  sum.t = terms(d, {s.a, ds.a}, {s.b, ds.b}, changes(d), sum.x.data(), sum.rho.data()).t;
  return sum;
}

}  // namespace costate
