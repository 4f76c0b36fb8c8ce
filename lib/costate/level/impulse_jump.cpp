#include "costate/level/impulse_jump.h"

#include <algorithm>

#include "costate/level/fixed_times.h"

namespace costate {

const double* ImpulseJump::calc(const StateView& before, double t_after) {
  const int n = assembly_.n(), m = assembly_.m();
  assembly_.calc_constraints(before);
  const std::vector<double> driven = assembly_.phi_t;
  StateView after = before;
  after.t = t_after;
  balance_->prepare(after);
  solution_.assign(static_cast<std::size_t>(n + m), 0);
  for (int i = 0; i < m; ++i) solution_[n + i] = driven[i] - assembly_.phi_t[i];
  balance_->solve(solution_.data());
  after_.assign(before.v, before.v + n);
  for (int i = 0; i < n; ++i) after_[i] += solution_[i];
  return after_.data();
}

void ImpulseJump::linearize(const StateView& before, double t_after, bool columns) {
  const int n = assembly_.n(), m = assembly_.m();
  const std::vector<double> rest(static_cast<std::size_t>(std::max(n, m)), 0);
  if (columns) require_fixed_kink(assembly_.mechanism(), assembly_.parameters(), assembly_.numbers(), t_after);
  calc(before, t_after);
  StateView s = before;
  s.a = s.lambda = rest.data();
  Assembly::ParameterColumns c;
  assembly_.calc_dynamics(s);
  assembly_.calc_partials(s);
  phid_q_ = assembly_.phid_q;
  if (columns) {
    assembly_.calc_parameter_columns(s, c);
    phid_ = c.phid;
  }
  s.t = t_after;
  s.v = after_.data();
  balance_->prepare(s);
  assembly_.calc_partials(s);
  for (std::size_t k = 0; k < phid_q_.size(); ++k) phid_q_[k] = assembly_.phid_q[k] - phid_q_[k];
  const double *u = solution_.data(), *P = u + n;
  hessian_.resize(assembly_.square().row.size());
  assembly_.calc_projection_hessian(s, u, P, hessian_);
  if (!columns) return;
  assembly_.calc_parameter_columns(s, c);
  phid_ = c.phid - phid_;
  force_.setZero(n, assembly_.np());
  assembly_.calc_projection_columns(s, u, P, force_);
}

const double* ImpulseJump::tangent(const StateView& before, double t_after, double* const* y, int count) {
  const int n = assembly_.n(), m = assembly_.m();
  linearize(before, t_after, true);
  std::vector<double> b(static_cast<std::size_t>(n + m));
  for (int j = 0; j < count; ++j) {
    for (int i = 0; i < n; ++i) b[i] = -force_(i, j);
    for (int i = 0; i < m; ++i) b[n + i] = -phid_(i, j);
    add_product(assembly_.square(), hessian_.data(), -1, y[j], b.data());
    add_product(assembly_.jacobian(), phid_q_.data(), -1, y[j], b.data() + n);
    balance_->solve(b.data());
    for (int i = 0; i < n; ++i) y[j][n + i] += b[i];
  }
  return after_.data();
}

void ImpulseJump::adjoint(const StateView& before, double t_after, double* mu, double* gradient) {
  const int n = assembly_.n(), m = assembly_.m();
  if (assembly_.np() > 0)
    require_fixed_kink(assembly_.mechanism(), assembly_.parameters(), assembly_.numbers(), t_after);
  linearize(before, t_after, false);
  std::vector<double> s(static_cast<std::size_t>(n + m), 0);
  std::copy(mu + n, mu + 2 * n, s.begin());
  balance_->solve(s.data());
  add_transposed_product(assembly_.square(), hessian_.data(), -1, s.data(), mu);
  add_transposed_product(assembly_.jacobian(), phid_q_.data(), -1, s.data() + n, mu);
  if (assembly_.np() == 0) return;
  // -s1^T (M u + Phi_q^T P)_rho - s2^T (Phid_rho behind the kink - Phid_rho before it)
  StateView x = before;
  x.a = x.lambda = nullptr;
  Assembly::ParameterWeights w;
  w.row_phid = s.data() + n;
  assembly_.add_parameter_gradient(x, w, 1, gradient);
  x.t = t_after;
  x.v = after_.data();
  assembly_.add_parameter_gradient(x, w, -1, gradient);
  assembly_.add_projection_gradient(x, solution_.data(), solution_.data() + n, s.data(), -1, gradient);
}

}  // namespace costate
