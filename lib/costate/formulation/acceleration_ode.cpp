#include "costate/formulation/acceleration_ode.h"

#include "costate/analysis/start.h"
#include "costate/assembly/packed_state.h"
#include "costate/level/solved_end.h"
#include "costate/level/unknown_names.h"

namespace costate {

AccelerationOde::AccelerationOde(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                 Objective objective, Stabilization stabilization)
    : OdeSystem(std::move(mechanism), std::move(parameters), std::move(objective)),
      level_(assembly_, stabilization),
      velocity_jump_(assembly_, level_) {
  append_differential_unknowns(assembly_.mechanism(), unknowns_);
  if (events_) events_->use(velocity_jump_.balance());
  kkt_.assign(static_cast<std::size_t>(assembly_.n() + assembly_.m()), 0);
  reduced_.assign(static_cast<std::size_t>(level_.newton_size()), 0);
  if (!assembly_.has_switched_rows()) pulled_partials_.emplace(assembly_);
}

StateView AccelerationOde::view(double t, const double* y) const { return packed_view(t, y, assembly_.n()); }

MechanismState AccelerationOde::mechanism_state(double t, const double* y) {
  level_.solve(view(t, y));
  return level_.state();
}

void AccelerationOde::linearize(double t, const double* y) {
  level_.solve(view(t, y));
  level_.linearize();
}

void AccelerationOde::rhs(double t, const double* y, double* f) {
  const int n = assembly_.n();
  level_.solve(view(t, y));
  for (int i = 0; i < n; ++i) {
    f[i] = y[n + i];
    f[n + i] = level_.a()[i];
  }
  for (int i = 0; i < assembly_.nz(); ++i) f[2 * n + i] = assembly_.zdot[i];
}

void AccelerationOde::factor(double t, const double* y, double gamma) {
  linearize(t, y);
  level_.factor_newton(gamma);
}

void AccelerationOde::solve(double* b) {
  const auto& blocks = level_.newton_blocks();
  // (dv, dz, gamma dlambda) from the reduced matrix, dq = b_q + gamma dv.
  const int n = assembly_.n(), nz = assembly_.nz();
  const double g = level_.gamma();
  double *u = reduced_.data(), *uz = u + n, *ul = uz + nz;
  std::fill(reduced_.begin(), reduced_.end(), 0.0);
  double *bq = b, *bv = b + n, *bz = b + 2 * n;
  costate::add_product(assembly_.square(), blocks.M.data(), 1, bv, u);
  add_product(assembly_.square(), blocks.K.data(), -g, bq, u);
  costate::add_product(assembly_.jacobian(), blocks.phi_q.data(), 1, bv, ul);
  add_product(assembly_.jacobian(), blocks.R2_q.data(), -g, bq, ul);
  for (int i = 0; i < nz; ++i) uz[i] = bz[i];
  if (nz > 0) add_product(assembly_.state_force(), blocks.f_q.data(), g, bq, uz);
  level_.solve_newton(u);
  for (int i = 0; i < n; ++i) {
    bv[i] = u[i];
    bq[i] += g * u[i];
  }
  for (int i = 0; i < nz; ++i) bz[i] = uz[i];
}

void AccelerationOde::solve_transposed(double* b) {
  const auto& blocks = level_.newton_blocks();
  const int n = assembly_.n(), nz = assembly_.nz();
  const double g = level_.gamma();
  double *u = reduced_.data(), *uz = u + n, *ul = uz + nz;
  double *bq = b, *bv = b + n, *bz = b + 2 * n;
  std::fill(reduced_.begin(), reduced_.end(), 0.0);
  for (int i = 0; i < n; ++i) u[i] = bv[i] + g * bq[i];
  for (int i = 0; i < nz; ++i) uz[i] = bz[i];
  level_.solve_newton_transposed(u);
  add_transposed_product(assembly_.square(), blocks.K.data(), -g, u, bq);
  add_transposed_product(assembly_.jacobian(), blocks.R2_q.data(), -g, ul, bq);
  if (nz > 0) add_transposed_product(assembly_.state_force(), blocks.f_q.data(), g, uz, bq);
  std::fill(bv, bv + n, 0.0);
  costate::add_product(assembly_.square(), blocks.M.data(), 1, u, bv);
  costate::add_transposed_product(assembly_.jacobian(), blocks.phi_q.data(), 1, ul, bv);
  for (int i = 0; i < nz; ++i) bz[i] = uz[i];
}

void AccelerationOde::solve_tangent(const double* const* s, int count, bool with_parameters) {
  if (with_parameters) assembly_.calc_parameter_columns(level_.state(), columns_);
  const auto needed = static_cast<std::size_t>(assembly_.n() + assembly_.m()) * static_cast<std::size_t>(count);
  if (kkt_.size() < needed) kkt_.resize(needed);
  level_.solve_tangent(s, count, with_parameters ? &columns_ : nullptr, kkt_.data());
}

void AccelerationOde::tangent(double t, const double* y, const double* const* s, double* const* out, int count,
                              bool with_parameters) {
  linearize(t, y);
  solve_tangent(s, count, with_parameters);
  const int n = assembly_.n(), nz = assembly_.nz(), k = n + assembly_.m();
  for (int j = 0; j < count; ++j) {
    const double* x = kkt_.data() + static_cast<std::ptrdiff_t>(j) * k;
    for (int i = 0; i < n; ++i) {
      out[j][i] = s[j][n + i];
      out[j][n + i] = x[i];
    }
    for (int i = 0; i < nz; ++i) out[j][2 * n + i] = with_parameters ? columns_.f(i, j) : 0;
    level_.add_state_rows(1, s[j], s[j] + n, s[j] + 2 * n, out[j] + 2 * n);
  }
}

void AccelerationOde::tangent_cost(bool terminal, double t, const double* y, const double* const* s, double* out,
                                   int count) {
  linearize(t, y);
  if (terminal) {
    cost_gradient_at_ = 0;
    cost_gradient_.set_zero();
    objective_.add_terminal_gradient(level_.state(), assembly_, cost_gradient_);
  } else {
    calc_running_gradient();
  }
  const bool accelerations =
      terminal ? objective_.terminal_needs_accelerations() : objective_.running_needs_accelerations();
  if (accelerations) solve_tangent(s, count, true);
  const int n = assembly_.n(), m = assembly_.m(), nz = assembly_.nz();
  const ScalarGradient& g = cost_gradient_;
  for (int j = 0; j < count; ++j) {
    double sum = g.rho[j];
    for (int i = 0; i < n; ++i) sum += g.q[i] * s[j][i] + g.v[i] * s[j][n + i];
    for (int i = 0; i < nz; ++i) sum += g.z[i] * s[j][2 * n + i];
    if (accelerations) {
      const double* x = kkt_.data() + static_cast<std::ptrdiff_t>(j) * (n + m);
      for (int i = 0; i < n; ++i) sum += g.a[i] * x[i];
      for (int i = 0; i < m; ++i) sum += g.lambda[i] * x[n + i];
    }
    out[j] = sum;
  }
}

void AccelerationOde::tangent_running_cost(double t, const double* y, const double* const* s, double* out, int count) {
  tangent_cost(false, t, y, s, out, count);
}

void AccelerationOde::tangent_terminal_cost(double t, const double* y, const double* const* s, double* out, int count) {
  tangent_cost(true, t, y, s, out, count);
}

void AccelerationOde::calc_running_gradient() {
  if (cost_gradient_at_ == level_.point()) return;
  cost_gradient_.set_zero();
  objective_.add_running_gradient(level_.state(), assembly_, cost_gradient_);
  cost_gradient_at_ = level_.point();
}

void AccelerationOde::running_cost_gradient(double t, const double* y, double* g_y) {
  const bool accelerations = objective_.running_needs_accelerations();
  if (accelerations) {
    solve_adjoint(t, y, nullptr);
  } else {
    cost_gradient_at_ = 0;
    cost_gradient_.set_zero();
    objective_.add_running_gradient(view(t, y), assembly_, cost_gradient_);
  }
  const int n = assembly_.n();
  const ScalarGradient& g = cost_gradient_;
  std::copy(g.q.data(), g.q.data() + n, g_y);
  std::copy(g.v.data(), g.v.data() + n, g_y + n);
  std::copy(g.z.data(), g.z.data() + assembly_.nz(), g_y + 2 * n);
  if (accelerations) level_.add_transposed(-1, kkt_.data(), kkt_.data() + n, nullptr, g_y, g_y + n, g_y + 2 * n);
}

void AccelerationOde::solve_adjoint(double t, const double* y, const double* mu) {
  linearize(t, y);
  calc_running_gradient();
  const int n = assembly_.n(), m = assembly_.m();
  for (int i = 0; i < n; ++i) kkt_[i] = (mu ? mu[n + i] : 0) + cost_gradient_.a[i];
  for (int i = 0; i < m; ++i) kkt_[n + i] = cost_gradient_.lambda[i];
  level_.solve_kkt_transposed(kkt_.data());
}

void AccelerationOde::adjoint_rhs(double t, const double* y, const double* mu, double* mup) {
  solve_adjoint(t, y, mu);
  const int n = assembly_.n(), nz = assembly_.nz();
  const ScalarGradient& g = cost_gradient_;
  for (int i = 0; i < n; ++i) {
    mup[i] = -g.q[i];
    mup[n + i] = -g.v[i] - mu[i];
  }
  for (int i = 0; i < nz; ++i) mup[2 * n + i] = -g.z[i];
  level_.add_transposed(1, kkt_.data(), kkt_.data() + n, mu + 2 * n, mup, mup + n, mup + 2 * n);
}

void AccelerationOde::adjoint_integrand(double t, const double* y, const double* mu, double* out) {
  solve_adjoint(t, y, mu);
  for (int j = 0; j < assembly_.np(); ++j) out[j] = cost_gradient_.rho[j];
  const int n = assembly_.n();
  const auto w = level_.stabilization().weights(kkt_.data(), kkt_.data() + n, mu + 2 * n);
  assembly_.add_parameter_gradient(level_.state(), w, -1, out);
}

void AccelerationOde::pull_stage(double t, const double* y, const double* w, double c, double* pulled,
                                 double* gradient) {
  if (!level_.brought_back(view(t, y))) level_.solve(view(t, y));
  // Rows that come and go are in the blocks alone.
  const bool blocks = !pulled_partials_, cost = c != 0;
  if (blocks) level_.linearize();
  if (cost) calc_running_gradient();
  const int n = assembly_.n(), m = assembly_.m(), nz = assembly_.nz();
  const ScalarGradient& g = cost_gradient_;
  for (int i = 0; i < n; ++i) kkt_[i] = w[n + i] + (cost ? c * g.a[i] : 0);
  for (int i = 0; i < m; ++i) kkt_[n + i] = cost ? c * g.lambda[i] : 0;
  level_.solve_kkt_transposed(kkt_.data());
  for (int i = 0; i < n; ++i) {
    pulled[i] = cost ? c * g.q[i] : 0;
    pulled[n + i] = w[i] + (cost ? c * g.v[i] : 0);
  }
  for (int i = 0; i < nz; ++i) pulled[2 * n + i] = cost ? c * g.z[i] : 0;
  const double *s1 = kkt_.data(), *s2 = s1 + n, *sz = w + 2 * n;
  const auto weights = level_.stabilization().weights(s1, s2, sz);
  if (blocks)
    level_.add_transposed(-1, s1, s2, sz, pulled, pulled + n, pulled + 2 * n);
  else
    pulled_partials_->add(level_.state(), weights, -1, pulled, pulled + n, pulled + 2 * n);
  if (cost)
    for (int j = 0; j < assembly_.np(); ++j) gradient[j] += c * g.rho[j];
  assembly_.add_parameter_gradient(level_.state(), weights, -1, gradient);
}

void AccelerationOde::terminal_adjoint(double t, const double* y, double* mu, double* gradient) {
  linearize(t, y);
  const int n = assembly_.n();
  cost_gradient_at_ = 0;
  cost_gradient_.set_zero();
  objective_.add_terminal_gradient(level_.state(), assembly_, cost_gradient_);
  ScalarGradient& g = cost_gradient_;
  for (int j = 0; j < assembly_.np(); ++j) gradient[j] += g.rho[j];
  if (objective_.terminal_needs_accelerations()) eliminate_at_end(level_, assembly_, level_.state(), g, 1, gradient);
  std::copy(g.q.data(), g.q.data() + n, mu);
  std::copy(g.v.data(), g.v.data() + n, mu + n);
  std::copy(g.z.data(), g.z.data() + assembly_.nz(), mu + 2 * n);
}

void AccelerationOde::start(double t, double* y, Eigen::MatrixXd* y_rho) {
  const Start s = find_start(assembly_, t, y_rho != nullptr);
  const int n = assembly_.n(), nz = assembly_.nz();
  for (int i = 0; i < n; ++i) {
    y[i] = s.q[i];
    y[n + i] = s.v[i];
  }
  for (int i = 0; i < nz; ++i) y[2 * n + i] = s.z[i];
  if (!y_rho) return;
  y_rho->resize(size(), assembly_.np());
  *y_rho << s.q_rho, s.v_rho, s.z_rho;
}

void AccelerationOde::jump(double t, double* y) {
  if (pending_event_ >= 0) {
    events_->cross(pending_event_, view(t, y), y + assembly_.n(), y + 2 * assembly_.n());
    return;
  }
  cross_kink(t, y);
}

void AccelerationOde::cross_kink(double t, double* y) {
  const double* v = velocity_jump_.calc(view(t, y), segment_start(t));
  std::copy(v, v + assembly_.n(), y + assembly_.n());
}

void AccelerationOde::jump_tangent(const Jump& jump, double* const* s, int count) {
  jump_cost_tangent_.clear();
  if (jump.event >= 0) {
    jump_cost_tangent_.assign(static_cast<std::size_t>(count), 0);
    std::vector<double> after = jump.y;
    const StateView before = view(jump.t, jump.y.data());
    events_->cross(jump.event, before, after.data() + assembly_.n(), after.data() + 2 * assembly_.n());
    const auto minus = event_side(jump.t, jump.y.data()), plus = event_side(jump.t, after.data());
    events_->tangent(jump.event, before, minus, plus, s, count, jump_cost_tangent_.data());
    return;
  }
  const auto moving = moving_time(jump, [&](double* y, double*) { cross_kink(jump.t, y); });
  set_cost_tangent(moving);
  velocity_jump_.tangent(view(jump.t, jump.y.data()), segment_start(jump.t), s, count, moving ? &*moving : nullptr);
}

void AccelerationOde::jump_adjoint(const Jump& jump, double* mu, double* gradient) {
  if (jump.event >= 0) {
    std::vector<double> after = jump.y;
    const StateView before = view(jump.t, jump.y.data());
    events_->cross(jump.event, before, after.data() + assembly_.n(), after.data() + 2 * assembly_.n());
    const auto minus = event_side(jump.t, jump.y.data()), plus = event_side(jump.t, after.data());
    events_->adjoint(jump.event, before, minus, plus, mu, gradient);
    cost_gradient_at_ = 0;
    return;
  }
  const auto moving = moving_time(jump, [&](double* y, double*) { cross_kink(jump.t, y); });
  velocity_jump_.adjoint(view(jump.t, jump.y.data()), segment_start(jump.t), mu, gradient, moving ? &*moving : nullptr);
  cost_gradient_at_ = 0;
}

}  // namespace costate
