#include "costate/level/maggi_level.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/analysis/start.h"
#include "costate/assembly/slip_directions.h"
#include "costate/base/error.h"
#include "costate/level/maggi_ratio.h"
#include "costate/level/solved_end.h"

namespace costate {

MaggiLevel::MaggiLevel(Assembly& assembly)
    : assembly_(assembly),
      positions_(assembly),
      mass_(assembly, positions_),
      n_(assembly.n()),
      m_(assembly.m()),
      f_(positions_.freedoms()),
      nz_(assembly.nz()),
      rows_(std::max(m_ + f_, n_)),
      point_(assembly),
      look_point_(assembly),
      accelerated_(assembly) {
  const auto n = static_cast<std::size_t>(n_), rows = static_cast<std::size_t>(rows_);
  v_.assign(rows, 0);
  a_ = work_ = reaction_ = s1_ = reaction_q_ = reaction_v_ = reaction_a_ = v_;
  w_.assign(static_cast<std::size_t>(f_), 0);
  lambda_.assign(static_cast<std::size_t>(m_), 0);
  normal_.assign(n, 0);
  g_q_.assign(n, 0);
  g_v_ = g_a_ = zero_ = g_q_;
  g_z_.assign(static_cast<std::size_t>(nz_), 0);
  null_weight_ = along_ = lambda_;
  hessian_.assign(assembly.square().row.size(), 0);
  if (assembly.has_switched_rows()) with_multipliers_ = std::make_unique<AccelerationLevel>(assembly, Stabilization{});
}

void MaggiLevel::clear() {
  accelerated_.forget();
  mass_.clear();
  dynamic_ = has_multipliers_ = false;
}

void MaggiLevel::start(const StateView& s) {
  point_.forget();
  branch_.forget();
  positions_.start(s);
  mass_.forget_chart();
}

void MaggiLevel::enter_rows(const StateView& s, int chart) {
  if (!assembly_.has_switched_rows()) return;
  positions_.enter_rows(s, chart);
  point_.forget();
  mass_.forget_chart();
}

void MaggiLevel::remember() {
  positions_.remember();
  if (accelerated())
    branch_.keep(state(), n_);
  else
    branch_.forget();
}

void MaggiLevel::forget_history() {
  point_.forget();
  branch_.forget();
  positions_.forget_history();
  mass_.forget_chart();
}

void MaggiLevel::use_chart(int chart) {
  if (chart == positions_.chart_index()) return;
  point_.forget();
  positions_.use_chart(chart);
  mass_.forget_chart();
}

void MaggiLevel::change_chart() {
  const bool from_null_space = !sparse() || f_ <= kMostExactFreedoms;
  positions_.change(from_null_space ? mass_.null_space() : nullptr);
  mass_.forget_chart();
  point_.forget();
}

void MaggiLevel::solve(double t, const double* y, const double* yd, const double* z) {
  const auto f = static_cast<std::size_t>(f_), nz = static_cast<std::size_t>(nz_);
  const long point = point_.move_to(t, {{y, f}, {yd, f}, {z, nz}});
  if (solved_at_ == point && assembly_.has_dynamics(point)) return;
  solved_at_ = 0;  // while it may throw
  clear();
  if (!positions_.started()) {
    const Start start = find_start(assembly_, t, false);
    positions_.start(start.state(t));
  }
  assembly_.switch_rows(z);
  positions_.require_rows();
  positions_.solve(t, y);
  for (int i = 0; i < m_; ++i) v_[i] = -assembly_.phi_t[i];
  std::copy(yd, yd + f_, v_.begin() + m_);
  positions_.chart().solve(v_.data());
  positions_.set_rates(v_.data(), nullptr);
  assembly_.calc_dynamics(state(), point);
  positions_.factor_reactions();
  solved_at_ = point;
}

StateView MaggiLevel::look(double t, const double* y, const double* yd, const double* z) {
  if (!positions_.started()) {
    solve(t, y, yd, z);
    return state();
  }
  assembly_.switch_rows(z);
  if (!looks_) looks_ = std::make_unique<MaggiPositions>(assembly_);
  const auto f = static_cast<std::size_t>(f_), nz = static_cast<std::size_t>(nz_);
  const long before = look_point_.id();
  const bool other_chart = looks_->begin_as(positions_);
  if (look_point_.move_to(t, {{y, f}, {yd, f}, {z, nz}}) != before || other_chart) {
    look_point_.forget();  // while it may throw
    if (!looks_->solve_by_factors_of(positions_, t, y, yd, look_v_)) {
      if (!looks_->solve_between(t, y)) looks_->solve(t, y);
      look_v_.resize(static_cast<std::size_t>(rows_));
      for (int i = 0; i < m_; ++i) look_v_[i] = -assembly_.phi_t[i];
      std::copy(yd, yd + f_, look_v_.begin() + m_);
      looks_->chart().solve(look_v_.data());
    }
    look_point_.move_to(t, {{y, f}, {yd, f}, {z, nz}});
  }
  StateView s;
  s.t = t;
  s.q = looks_->q();
  s.v = look_v_.data();
  s.z = look_point_.values() + 2 * f_;
  return s;
}

StateView MaggiLevel::state() const {
  StateView s;
  s.t = point_.t();
  s.q = positions_.q();
  s.v = v_.data();
  s.a = a_.data();
  s.lambda = lambda_.data();
  s.z = point_.values() + 2 * f_;
  return s;
}

StateView MaggiLevel::shared_state() {
  with_multipliers_->solve(state());
  return with_multipliers_->state();
}

void MaggiLevel::eliminate_shares(ScalarGradient& g) {
  with_multipliers_->solve(state());
  with_multipliers_->linearize();
  eliminate_at_end(*with_multipliers_, assembly_, with_multipliers_->state(), g, 1, g.rho.data());
  g.a.setZero();
  g.lambda.setZero();
  linearize();
}

// [u; p] with Phi_q u = g, M u + Phi_q^T p = h: u = S g + R y, My y = R^T (h - M S g), p = S^T (h - M u).
void MaggiLevel::solve_impulses(double* b) {
  MaggiChart& X = positions_.chart();
  std::vector<double> u(static_cast<std::size_t>(rows_), 0), y(static_cast<std::size_t>(f_)), h = u;
  std::copy(b + n_, b + n_ + m_, u.begin());
  X.solve(u.data());
  std::copy(b, b + n_, h.begin());
  add_product(assembly_.square(), assembly_.M.data(), -1, u.data(), h.data());
  project(h.data(), y.data());
  solve_mass(y.data());
  expand(y.data(), h.data());
  for (int i = 0; i < n_; ++i) u[i] += h[i];
  std::copy(b, b + n_, h.begin());
  add_product(assembly_.square(), assembly_.M.data(), -1, u.data(), h.data());
  X.solve_transposed(h.data());
  std::copy(u.begin(), u.begin() + n_, b);
  std::copy(h.begin(), h.begin() + m_, b + n_);
}

void MaggiLevel::set_accelerations(const double* w) {
  const long before = accelerated_.id();
  if (accelerated_.move_to(point_.t(), {{w, static_cast<std::size_t>(f_)}}) == before) return;
  dynamic_ = has_multipliers_ = false;
  if (w != w_.data()) std::copy(w, w + f_, w_.begin());
  for (int i = 0; i < m_; ++i) a_[i] = -assembly_.bias[i];
  std::copy(w, w + f_, a_.begin() + m_);
  positions_.chart().solve(a_.data());
  positions_.set_rates(v_.data(), a_.data());
}

void MaggiLevel::solve_accelerations() {
  if (dynamic_) return;
  // With a0 = S c first: My w = R^T (Q - M a0), a = a0 + R w.
  for (int i = 0; i < m_; ++i) a_[i] = -assembly_.bias[i];
  std::fill(a_.begin() + m_, a_.end(), 0.0);
  positions_.chart().solve(a_.data());
  for (int i = 0; i < n_; ++i) work_[i] = assembly_.Q[i];
  add_product(assembly_.square(), assembly_.M.data(), -1, a_.data(), work_.data());
  project(work_.data(), w_.data());
  solve_mass(w_.data());
  expand(w_.data(), work_.data());
  for (int i = 0; i < n_; ++i) a_[i] += work_[i];
  positions_.set_rates(v_.data(), a_.data());
  accelerated_.move_to(point_.t(), {w_});
  dynamic_ = true;
  has_multipliers_ = false;
}

void MaggiLevel::solve_multipliers() {
  if (has_multipliers_) return;
  for (int i = 0; i < n_; ++i) reaction_[i] = -assembly_.Q[i];
  add_product(assembly_.square(), assembly_.M.data(), 1, a_.data(), reaction_.data());
  MaggiChart& X = positions_.reaction_chart();
  X.solve_transposed(reaction_.data());
  for (int i = 0; i < m_; ++i) lambda_[i] = -reaction_[i];
  add_friction_multipliers(assembly_, lambda_.data());
  if (X.redundant()) std::copy_n(X.normal_solution(), n_, normal_.begin());
  has_multipliers_ = true;
}

void MaggiLevel::linearize() {
  solve_multipliers();
  if (assembly_.has_partials(accelerated_.id())) return;
  assembly_.calc_partials(state(), accelerated_.id());
  add_slip_forces(assembly_, state(), slip_q_, slip_v_);
}

void MaggiLevel::push(const double* const* s, int count, bool with_w, bool with_parameters) {
  const auto columns = static_cast<std::size_t>(count);
  if (dq_.size() < columns * rows_) {
    for (auto* x : {&dq_, &dv_, &da_}) x->resize(columns * rows_);
    force_.resize(columns * n_);
    rate_.resize(columns * nz_);
  }
  if (with_parameters) assembly_.calc_parameter_columns(state(), columns_);
  for (auto* x : {&dq_, &dv_, &da_}) std::fill_n(x->begin(), columns * rows_, 0.0);
  std::fill_n(force_.begin(), columns * n_, 0.0);
  std::fill_n(rate_.begin(), columns * nz_, 0.0);
  std::fill(along_.begin(), along_.end(), 0.0);
  MaggiChart& X = positions_.chart();
  const SparsePattern& rows = assembly_.jacobian();
  const auto column = [&](std::vector<double>& x, int j) { return x.data() + static_cast<std::ptrdiff_t>(j) * rows_; };
  for (int j = 0; j < count; ++j) {
    double* x = column(dq_, j);
    if (with_parameters)
      for (int i = 0; i < m_; ++i) x[i] = -columns_.phi(i, j);
    positions_.add_places(s[j], x);
    std::copy(s[j], s[j] + f_, x + m_);
  }
  X.solve(dq_.data(), count);
  for (int j = 0; j < count; ++j) {
    double* x = column(dv_, j);
    if (with_parameters)
      for (int i = 0; i < m_; ++i) x[i] = -columns_.phid(i, j);
    add_product(rows, assembly_.phid_q.data(), -1, dq(j), x);
    std::copy(s[j] + f_, s[j] + 2 * f_, x + m_);
  }
  X.solve(dv_.data(), count);
  for (int j = 0; j < count; ++j) {
    double* x = column(da_, j);
    if (with_parameters)
      for (int i = 0; i < m_; ++i) x[i] = -columns_.phidd(i, j);
    add_product(rows, assembly_.phidd_q.data(), -1, dq(j), x);
    add_product(rows, assembly_.phid_q.data(), -2, dv(j), x);
    if (with_w) std::copy_n(s[j] + 2 * f_ + nz_, f_, x + m_);
  }
  X.solve(da_.data(), count);
  for (int j = 0; j < count; ++j) {
    double *x = force_.data() + static_cast<std::ptrdiff_t>(j) * n_,
           *r = rate_.data() + static_cast<std::ptrdiff_t>(j) * nz_;
    const double* dz = s[j] + 2 * f_;
    add_product(assembly_.square(), assembly_.M.data(), 1, da(j), x);
    add_product(assembly_.square(), assembly_.K.data(), 1, dq(j), x);
    add_product(assembly_.square(), assembly_.C.data(), 1, dv(j), x);
    if (with_parameters) {
      for (int i = 0; i < n_; ++i) x[i] += columns_.F(i, j);
      // lambda_t = -s mu lambda_n
      for (const Assembly::SlidingRow& at : assembly_.sliding_rows()) along_[at.along] = columns_.phidd(at.along, j);
      if (slides()) add_transposed_product(rows, assembly_.reaction_jacobian().data(), 1, along_.data(), x);
      for (int i = 0; i < nz_; ++i) r[i] = columns_.f(i, j);
    }
    if (nz_ == 0) continue;
    add_product(assembly_.force_state(), assembly_.Q_z.data(), -1, dz, x);
    add_product(assembly_.state_force(), assembly_.f_q.data(), 1, dq(j), r);
    add_product(assembly_.state_force(), assembly_.f_v.data(), 1, dv(j), r);
    add_product(assembly_.state_state(), assembly_.f_z.data(), 1, dz, r);
  }
}

}  // namespace costate
