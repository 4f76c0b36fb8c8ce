#include "costate/level/impulse_jump.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"

namespace costate {

namespace {
constexpr double kDrivenJump = 1e-12;  // of a driven velocity: less is rounding
}  // namespace

const double* ImpulseJump::calc(const StateView& before, double t_after) {
  const int n = assembly_.n(), m = assembly_.m();
  assembly_.calc_constraints(before);
  const std::vector<double> driven = assembly_.phi_t;
  StateView after = before;
  after.t = t_after;
  balance_->prepare(after);
  solution_.assign(static_cast<std::size_t>(n + m), 0);
  for (int i = 0; i < m; ++i) solution_[n + i] = driven[i] - assembly_.phi_t[i];
  // Where a force's law jumps, or a cost's weight, nothing does here.
  const bool slides = !assembly_.sliding_rows().empty();
  for (int i = 0; i < m; ++i)
    if (slides && std::abs(solution_[n + i]) > kDrivenJump * (std::abs(driven[i]) + std::abs(assembly_.phi_t[i])))
      throw CapabilityError(fmt::format(
          "At t = {:.9g} s a driven velocity jumps ({}) while a contact slides ({}), whose impulse is not there yet. "
          "Take a driver without a kink there.",
          before.t, assembly_.mechanism().row_names()[static_cast<std::size_t>(i)],
          assembly_.mechanism().row_names()[static_cast<std::size_t>(assembly_.sliding_rows().front().along)]));
  balance_->solve(solution_.data());
  after_.assign(before.v, before.v + n);
  for (int i = 0; i < n; ++i) after_[i] += solution_[i];
  return after_.data();
}

void ImpulseJump::linearize(const StateView& before, double t_after, bool columns) {
  const int n = assembly_.n(), m = assembly_.m();
  const std::vector<double> rest(static_cast<std::size_t>(std::max(n, m)), 0);
  calc(before, t_after);
  StateView s = before;
  s.a = s.lambda = rest.data();
  Assembly::ParameterColumns c;
  assembly_.calc_dynamics(s);
  assembly_.calc_partials(s);
  phid_q_ = assembly_.phid_q;
  // Phidot_t = bias - Phidot_q v.
  phid_t_ = assembly_.bias;
  add_product(assembly_.jacobian(), phid_q_.data(), -1, s.v, phid_t_.data());
  if (columns) {
    assembly_.calc_parameter_columns(s, c);
    phid_ = c.phid;
  }
  s.t = t_after;
  s.v = after_.data();
  balance_->prepare(s);
  assembly_.calc_partials(s);
  std::vector<double> behind = assembly_.bias;
  add_product(assembly_.jacobian(), assembly_.phid_q.data(), -1, s.v, behind.data());
  for (int i = 0; i < m; ++i) phid_t_[i] = behind[i] - phid_t_[i];
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

const double* ImpulseJump::tangent(const StateView& before, double t_after, double* const* y, int count,
                                   const MovingTime* moving) {
  const int n = assembly_.n(), m = assembly_.m();
  linearize(before, t_after, true);
  std::vector<double> b(static_cast<std::size_t>(n + m));
  for (int j = 0; j < count; ++j) {
    const double dt = moving ? moving->by[static_cast<std::size_t>(j)] : 0;
    if (dt != 0)
      for (std::size_t i = 0; i < moving->before.size(); ++i) y[j][i] += dt * moving->before[i];
    for (int i = 0; i < n; ++i) b[i] = -force_(i, j);
    for (int i = 0; i < m; ++i) b[n + i] = -phid_(i, j) - dt * phid_t_[i];
    add_product(assembly_.square(), hessian_.data(), -1, y[j], b.data());
    add_product(assembly_.jacobian(), phid_q_.data(), -1, y[j], b.data() + n);
    balance_->solve(b.data());
    for (int i = 0; i < n; ++i) y[j][n + i] += b[i];
    if (dt != 0)
      for (std::size_t i = 0; i < moving->after.size(); ++i) y[j][i] -= dt * moving->after[i];
  }
  return after_.data();
}

void ImpulseJump::adjoint(const StateView& before, double t_after, double* mu, double* gradient,
                          const MovingTime* moving) {
  const int n = assembly_.n(), m = assembly_.m();
  linearize(before, t_after, false);
  double by_time = moving ? moving->cost : 0;
  if (moving)
    for (std::size_t i = 0; i < moving->after.size(); ++i) by_time -= mu[i] * moving->after[i];
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
  if (!moving) return;
  for (std::size_t i = 0; i < moving->before.size(); ++i) by_time += mu[i] * moving->before[i];
  for (int i = 0; i < m; ++i) by_time -= s[n + i] * phid_t_[i];
  for (int j = 0; j < assembly_.np(); ++j) gradient[j] += by_time * moving->by[static_cast<std::size_t>(j)];
}

}  // namespace costate
