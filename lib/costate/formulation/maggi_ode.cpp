#include "costate/formulation/maggi_ode.h"

#include <algorithm>

#include "costate/analysis/start.h"
#include "costate/assembly/switched_rows_refusal.h"
#include "costate/formulation/maggi_branch.h"
#include "costate/formulation/maggi_cost.h"
#include "costate/formulation/maggi_event.h"
#include "costate/level/maggi_names.h"

namespace costate {

MaggiOde::MaggiOde(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective)
    : SegmentedOde(std::move(mechanism), std::move(parameters), std::move(objective)),
      level_(assembly_),
      newton_(level_),
      kink_(level_),
      f_(level_.freedoms()),
      nz_(assembly_.nz()) {
  refuse_rows_without_place(assembly_);
  append_maggi_unknowns(assembly_.mechanism(), f_, unknowns_);
  if (events_) events_->use(kink_.balance());
  y_buffer_.assign(static_cast<std::size_t>(size()), 0);
  rho_buffer_.assign(static_cast<std::size_t>(assembly_.np()), 0);
}

void MaggiOde::solve_point(double t, const double* y) { level_.solve(t, y, y + f_, y + 2 * f_); }

MechanismState MaggiOde::kinematic_state(double t, const double* y) {
  solve_point(t, y);
  return level_.state();
}

MechanismState MaggiOde::mechanism_state(double t, const double* y) {
  solve_point(t, y);
  if (level_.shares()) return level_.shared_state();
  level_.solve_accelerations();
  level_.solve_multipliers();
  return level_.state();
}

void MaggiOde::linearize(double t, const double* y) {
  solve_point(t, y);
  level_.solve_accelerations();
  level_.linearize();
}

void MaggiOde::rhs(double t, const double* y, double* f) {
  solve_point(t, y);
  level_.solve_accelerations();
  evaluated_at_ = t;
  std::copy(y + f_, y + 2 * f_, f);
  std::copy(level_.w(), level_.w() + f_, f + f_);
  std::copy(assembly_.zdot.begin(), assembly_.zdot.end(), f + 2 * f_);
  std::fill(f + 2 * f_ + nz_, f + size(), 0.0);
}

void MaggiOde::factor(double t, const double* y, double gamma) {
  linearize(t, y);
  newton_.factor(gamma);
}

void MaggiOde::solve(double* b) { newton_.solve(b, b + f_, nullptr, b + 2 * f_); }
void MaggiOde::solve_transposed(double* b) { newton_.solve_transposed(b, b + f_, nullptr, b + 2 * f_); }

void MaggiOde::tangent(double t, const double* y, const double* const* s, double* const* out, int count,
                       bool with_parameters) {
  linearize(t, y);
  level_.push(s, count, false, with_parameters);
  for (int j = 0; j < count; ++j) {
    // My dydd = -R^T force
    double* w = out[j] + f_;
    level_.project(level_.force(j), w);
    for (int i = 0; i < f_; ++i) w[i] = -w[i];
    level_.solve_mass(w);
    std::copy(s[j] + f_, s[j] + 2 * f_, out[j]);
    std::copy(level_.state_rate(j), level_.state_rate(j) + nz_, out[j] + 2 * f_);
    std::fill(out[j] + 2 * f_ + nz_, out[j] + size(), 0.0);
  }
}

void MaggiOde::calc_running_gradient() {
  if (cost_gradient_at_ == level_.point()) return;
  cost_gradient_.set_zero();
  add_maggi_cost_gradient(level_, objective_, false, cost_gradient_);
  cost_gradient_at_ = level_.point();
}

void MaggiOde::pull_running(const double* mu) {
  calc_running_gradient();
  const bool accelerations = objective_.running_needs_accelerations();
  level_.pull(cost_gradient_, accelerations);
  if (mu || accelerations) level_.eliminate_accelerations(mu ? mu + f_ : nullptr);
  level_.finish_pull(mu ? mu + 2 * f_ : nullptr);
}

void MaggiOde::pull_terminal() {
  cost_gradient_at_ = 0;
  cost_gradient_.set_zero();
  add_maggi_cost_gradient(level_, objective_, true, cost_gradient_);
  const bool accelerations = objective_.terminal_needs_accelerations();
  level_.pull(cost_gradient_, accelerations);
  if (accelerations) level_.eliminate_accelerations(nullptr);
  level_.finish_pull(nullptr);
}

void MaggiOde::copy_pulled(double c, double* out) const {
  for (int i = 0; i < f_; ++i) {
    out[i] = c * level_.pulled_y()[i];
    out[f_ + i] = c * level_.pulled_yd()[i];
  }
  for (int i = 0; i < nz_; ++i) out[2 * f_ + i] = c * level_.pulled_z()[i];
  std::fill(out + 2 * f_ + nz_, out + size(), 0.0);
}

void MaggiOde::tangent_running_cost(double t, const double* y, const double* const* s, double* out, int count) {
  linearize(t, y);
  pull_running(nullptr);
  copy_pulled(1, y_buffer_.data());
  std::copy_n(cost_gradient_.rho.data(), assembly_.np(), rho_buffer_.begin());
  level_.add_pulled_parameters(1, rho_buffer_.data());
  for (int j = 0; j < count; ++j) {
    out[j] = rho_buffer_[j];
    for (int i = 0; i < size(); ++i) out[j] += y_buffer_[i] * s[j][i];
  }
}

void MaggiOde::tangent_terminal_cost(double t, const double* y, const double* const* s, double* out, int count) {
  std::fill(rho_buffer_.begin(), rho_buffer_.end(), 0.0);
  terminal_adjoint(t, y, y_buffer_.data(), rho_buffer_.data());
  for (int j = 0; j < count; ++j) {
    out[j] = rho_buffer_[j];
    for (int i = 0; i < size(); ++i) out[j] += y_buffer_[i] * s[j][i];
  }
}

void MaggiOde::running_cost_gradient(double t, const double* y, double* g_y) {
  linearize(t, y);
  pull_running(nullptr);
  copy_pulled(1, g_y);
}

void MaggiOde::adjoint_rhs(double t, const double* y, const double* mu, double* mup) {
  linearize(t, y);
  pull_running(mu);
  copy_pulled(-1, mup);
  for (int i = 0; i < f_; ++i) mup[f_ + i] -= mu[i];
}

void MaggiOde::adjoint_integrand(double t, const double* y, const double* mu, double* out) {
  linearize(t, y);
  pull_running(mu);
  std::copy_n(cost_gradient_.rho.data(), assembly_.np(), out);
  level_.add_pulled_parameters(1, out);
}

void MaggiOde::pull_stage(double t, const double* y, const double* w, double c, double* pulled, double* gradient) {
  linearize(t, y);
  cost_gradient_at_ = 0;
  cost_gradient_.set_zero();
  if (c != 0) {
    add_maggi_cost_gradient(level_, objective_, false, cost_gradient_);
    ScalarGradient& g = cost_gradient_;
    for (Eigen::VectorXd* part : {&g.q, &g.v, &g.a, &g.lambda, &g.z, &g.rho}) *part *= c;
  }
  level_.pull(cost_gradient_, c != 0 && objective_.running_needs_accelerations());
  level_.eliminate_accelerations(w + f_);
  level_.finish_pull(w + 2 * f_);
  copy_pulled(1, pulled);
  for (int i = 0; i < f_; ++i) pulled[f_ + i] += w[i];
  for (int j = 0; j < assembly_.np(); ++j) gradient[j] += cost_gradient_.rho[j];
  level_.add_pulled_parameters(1, gradient);
}

void MaggiOde::terminal_adjoint(double t, const double* y, double* mu, double* gradient) {
  linearize(t, y);
  pull_terminal();
  copy_pulled(1, mu);
  for (int j = 0; j < assembly_.np(); ++j) gradient[j] += cost_gradient_.rho[j];
  level_.add_pulled_parameters(1, gradient);
}

void MaggiOde::spread_start_weights(const StateView& start, const double* mu, double* w_q, double* w_v, double* w_z,
                                    double* gradient) {
  pull_coordinates(level_, start, mu, w_q, w_v, gradient);
  std::copy_n(mu + 2 * f_, nz_, w_z);
}

void MaggiOde::start(double t, double* y, Eigen::MatrixXd* y_rho) {
  const Start s = find_start(assembly_, t, y_rho != nullptr);
  level_.start(s.state(t));
  rename();
  std::fill(y, y + size(), 0.0);
  read_coordinates(level_, s.state(t), y);
  std::copy_n(s.z.data(), nz_, y + 2 * f_);
  if (!y_rho) return;
  y_rho->setZero(size(), assembly_.np());
  push_start(level_, s, t, *y_rho);
}

void MaggiOde::use_mode(int mode) {
  if (mode == level_.chart()) return;
  level_.use_chart(mode);
  rename();
}

void MaggiOde::rename() {
  name_maggi_unknowns(assembly_.mechanism(), level_.independent(), level_.places(), unknowns_);
}

bool MaggiOde::keeps_branch(double from, double t, const double* y) {
  solve_point(t, y);
  level_.solve_accelerations();
  return costate::keeps_branch(level_, from);
}

bool MaggiOde::wants_other_coordinates(double t, const double* y) {
  // Where a look within the step has moved the point: a repetition, which does not look, is still there. Left out, as
  // it once was, one judgement spanned thirty steps, and took a wheel that swung for a branch that was left.
  if (evaluated_at_ == t && !level_.solved_at(t)) {
    solve_point(t, y);
    level_.solve_accelerations();
  }
  return wants_other_chart(level_, t);
}

void MaggiOde::cross_event(int event, double t, double* y) { cross_event(event, t, y, -1); }

void MaggiOde::cross_event(int event, double t, double* y, int chart) {
  solve_point(t, y);
  costate::cross_event(level_, *events_, event, y, chart);
  rename();
  solve_point(t, y);
}

void MaggiOde::cross_event_tangent(const Jump& jump, double* const* s, int count) {
  std::vector<double> after = jump.y;
  use_mode(jump.before);
  cross_event(jump.event, jump.t, after.data(), jump.after);
  const auto plus = event_side(jump.t, after.data());
  use_mode(jump.before);
  const auto minus = event_side(jump.t, jump.y.data());
  linearize(jump.t, jump.y.data());
  jump_cost_tangent_.assign(static_cast<std::size_t>(count), 0);
  costate::cross_event_tangent(level_, *events_, jump.event, minus, plus, jump.after, after.data() + 2 * f_, s, count,
                               jump_cost_tangent_.data());
  rename();
}

void MaggiOde::cross_event_adjoint(const Jump& jump, double* mu, double* gradient) {
  std::vector<double> after = jump.y;
  cross_event(jump.event, jump.t, after.data(), jump.after);
  const auto plus = event_side(jump.t, after.data());
  use_mode(jump.before);
  const auto minus = event_side(jump.t, jump.y.data());
  solve_point(jump.t, jump.y.data());
  cost_gradient_at_ = 0;
  costate::cross_event_adjoint(level_, *events_, jump.event, minus, plus, jump.after, after.data() + 2 * f_, mu,
                               cost_gradient_, gradient);
  pull_weights(jump.t, jump.y.data(), mu, gradient);
}

void MaggiOde::adjoint_at(double t, const double* y, const double* w, double* mu, double* gradient) {
  cost_gradient_at_ = 0;
  cost_gradient_ = weights_of(assembly_, w);
  pull_weights(t, y, mu, gradient);
}

void MaggiOde::pull_weights(double t, const double* y, double* mu, double* gradient) {
  linearize(t, y);
  level_.pull(cost_gradient_, false);
  level_.finish_pull(nullptr);
  copy_pulled(1, mu);
  level_.add_pulled_parameters(1, gradient);
}

void MaggiOde::cross_kink(double t, double t_after, double* y) {
  solve_point(t, y);
  kink_.cross(t_after, y + f_);
  solve_point(t_after, y);
}

void MaggiOde::cross_kink_tangent(const Jump& before, double t_after, double* const* s, int count) {
  const auto moving = moving_time(before, [&](double* y, double*) { cross_kink(before.t, t_after, y); });
  set_cost_tangent(moving);
  linearize(before.t, before.y.data());
  kink_.tangent(t_after, s, count, moving ? &*moving : nullptr);
}

void MaggiOde::cross_kink_adjoint(const Jump& before, double t_after, double* mu, double* gradient) {
  const auto moving = moving_time(before, [&](double* y, double*) { cross_kink(before.t, t_after, y); });
  solve_point(before.t, before.y.data());
  const ScalarGradient& weights = kink_.adjoint(t_after, mu, gradient, moving ? &*moving : nullptr);
  linearize(before.t, before.y.data());
  level_.pull(weights, false);
  level_.finish_pull(nullptr);
  keep_places(level_, mu, [&] { copy_pulled(1, mu); });
  level_.add_pulled_parameters(1, gradient);
}

void MaggiOde::change_coordinates(double t, double* y) {
  solve_point(t, y);
  const StateView s = level_.state();
  level_.change_chart();
  const auto& independent = level_.independent();
  for (std::size_t i = 0; i < independent.size(); ++i) {
    y[i] = s.q[independent[i]];
    y[static_cast<std::size_t>(f_) + i] = s.v[independent[i]];
  }
  rename();
}

// dy after = (B2 dq, B2 dv, dz)
void MaggiOde::change_coordinates_tangent(const Jump& jump, double* const* s, int count) {
  use_mode(jump.after);
  const std::vector<int> independent = level_.independent();
  use_mode(jump.before);
  linearize(jump.t, jump.y.data());
  level_.push(s, count, false, true);
  for (int j = 0; j < count; ++j)
    for (std::size_t i = 0; i < independent.size(); ++i) {
      s[j][i] = level_.dq(j)[independent[i]];
      s[j][static_cast<std::size_t>(f_) + i] = level_.dv(j)[independent[i]];
    }
  use_mode(jump.after);
}

void MaggiOde::change_coordinates_adjoint(const Jump& jump, double* mu, double* gradient) {
  use_mode(jump.after);
  cost_gradient_at_ = 0;
  cost_gradient_.set_zero();
  const auto& independent = level_.independent();
  for (std::size_t i = 0; i < independent.size(); ++i) {
    cost_gradient_.q[independent[i]] = mu[i];
    cost_gradient_.v[independent[i]] = mu[static_cast<std::size_t>(f_) + i];
  }
  for (int i = 0; i < nz_; ++i) cost_gradient_.z[i] = mu[2 * f_ + i];
  use_mode(jump.before);
  linearize(jump.t, jump.y.data());
  level_.pull(cost_gradient_, false);
  level_.finish_pull(nullptr);
  keep_places(level_, mu, [&] { copy_pulled(1, mu); });
  level_.add_pulled_parameters(1, gradient);
}

}  // namespace costate
