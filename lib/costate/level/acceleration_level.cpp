#include "costate/level/acceleration_level.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "costate/analysis/not_finite.h"
#include "costate/analysis/start.h"
#include "costate/assembly/rolling_rows.h"
#include "costate/assembly/slip_directions.h"
#include "costate/base/error.h"
#include "costate/level/kkt_groups.h"

namespace costate {

namespace {
constexpr int kPivotOrders = 4;  // whose factorizations can be brought back
}  // namespace

AccelerationLevel::AccelerationLevel(Assembly& assembly, Stabilization stabilization)
    : assembly_(assembly),
      stabilization_(stabilization),
      kkt_(assembly.n() + assembly.m()),
      newton_(assembly.n() + assembly.nz() + assembly.m()),
      point_(assembly) {
  const int n = assembly.n(), m = assembly.m(), nz = assembly.nz();
  const SparsePattern identity_z = SparsePattern::identity(nz);
  const bool corner = has_corner();
  std::vector<std::pair<int, int>> entries = assembly.slidable_rows();
  for (int i = 0; i < m; ++i) entries.emplace_back(i, i);
  corner_pattern_ = SparsePattern::from_entries(m, m, std::move(entries));
  for (int i = 0; i < m; ++i) corner_diagonal_.push_back(corner_pattern_.find(i, i));
  kkt_mass_ = kkt_.place(assembly.square(), 0, 0);
  kkt_jacobian_ = kkt_.place(assembly.jacobian(), n, 0);
  kkt_transposed_ = kkt_.place(assembly.jacobian(), 0, n, true);
  if (corner) kkt_corner_ = kkt_.place(corner_pattern_, n, n);
  kkt_.finalize();
  newton_square_ = newton_.place(assembly.square(), 0, 0);
  newton_force_state_ = newton_.place(assembly.force_state(), 0, n);
  newton_transposed_ = newton_.place(assembly.jacobian(), 0, n + nz, true);
  newton_state_force_ = newton_.place(assembly.state_force(), n, 0);
  newton_state_state_ = newton_.place(assembly.state_state(), n, n);
  newton_state_identity_ = newton_.place(identity_z, n, n);
  newton_jacobian_ = newton_.place(assembly.jacobian(), n + nz, 0);
  if (corner) newton_corner_ = newton_.place(corner_pattern_, n + nz, n + nz);
  newton_.finalize();
  kkt_solver_ = std::make_unique<KktSolver>(kkt_.pattern(), kkt_groups(assembly, kkt_.pattern()));
  kkt_solver_->keep_pivot_orders(kPivotOrders);
  newton_solver_ = std::make_unique<KluSolver>(newton_.pattern());
  solution_.assign(static_cast<std::size_t>(n + m), 0);
  augmented_right_.reserve(static_cast<std::size_t>(newton_size()));
  augmented_last_.reserve(static_cast<std::size_t>(m));
  r2_q_.assign(assembly.jacobian().row.size(), 0);
  r2_v_ = r2_q_;
  newton_blocks_ = {assembly.M, assembly.K, assembly.phi_q, r2_q_, assembly.f_q};  // sized once
  if (stabilization_.inverse_alpha == 0 && assembly_.has_switched_rows()) giving_rows_ = GivingRows(assembly_);
}

void AccelerationLevel::prepare(const StateView& s) {
  const auto n = static_cast<std::size_t>(assembly_.n()), nz = static_cast<std::size_t>(assembly_.nz());
  solved_at_ = 0;
  assembly_.calc_dynamics(s, point_.move_to(s.t, {{s.q, n}, {s.v, n}, {s.z, nz}}));
  kkt_.set_zero();
  kkt_.add(kkt_mass_, assembly_.M.data());
  kkt_.add(kkt_jacobian_, assembly_.phi_q.data());
  kkt_.add(kkt_transposed_, assembly_.reaction_jacobian().data());
  if (kkt_corner_ >= 0) kkt_.add(kkt_corner_, corner());
  const int bad = kkt_solver_->factor(kkt_.values().data());
  if (bad >= 0) {
    require_finite(assembly_, s);
    singular(bad);
  }
}

const double* AccelerationLevel::corner() {
  corner_.assign(corner_pattern_.row.size(), 0);
  for (int i = 0; i < assembly_.m(); ++i)
    corner_[static_cast<std::size_t>(corner_diagonal_[static_cast<std::size_t>(i)])] = -inverse_alpha(i);
  for (const Assembly::SlidingRow& r : assembly_.sliding_rows())
    corner_[static_cast<std::size_t>(corner_pattern_.find(r.along, r.normal))] = -assembly_.friction(r);
  return corner_.data();
}

void AccelerationLevel::add_corner(double c, const double* x, double* out) const {
  if (!has_corner()) return;
  for (int i = 0; i < assembly_.m(); ++i) out[i] -= c * inverse_alpha(i) * x[i];
  for (const Assembly::SlidingRow& r : assembly_.sliding_rows())
    out[r.along] -= c * assembly_.friction(r) * x[r.normal];
}

void AccelerationLevel::add_corner_transposed(double c, const double* x, double* out) const {
  if (!has_corner()) return;
  for (int i = 0; i < assembly_.m(); ++i) out[i] -= c * inverse_alpha(i) * x[i];
  for (const Assembly::SlidingRow& r : assembly_.sliding_rows())
    out[r.normal] -= c * assembly_.friction(r) * x[r.along];
}

Eigen::MatrixXd AccelerationLevel::constraint_columns(const Assembly::ParameterColumns& c) const {
  Eigen::MatrixXd r = c.phidd + stabilization_.by_rate() * c.phid;
  for (int i = 0; i < assembly_.m(); ++i)
    if (assembly_.holds_position(i)) r.row(i) += stabilization_.by_value() * c.phi.row(i);
  return r;
}

void AccelerationLevel::calc_constraint_bias(const double* v, double* out) const {
  const double d = stabilization_.by_rate(), k = stabilization_.by_value();
  for (int i = 0; i < assembly_.m(); ++i) out[i] = assembly_.bias[i];
  if (d != 0 || k != 0) {
    for (int i = 0; i < assembly_.m(); ++i)
      out[i] += d * assembly_.phi_t[i] + (assembly_.holds_position(i) ? k * assembly_.phi[i] : 0);
    costate::add_product(assembly_.jacobian(), assembly_.phi_q.data(), d, v, out);
  }
}

void AccelerationLevel::solve(const StateView& s) {
  const auto size = static_cast<std::size_t>(assembly_.n()), states = static_cast<std::size_t>(assembly_.nz());
  const long point = point_.move_to(s.t, {{s.q, size}, {s.v, size}, {s.z, states}});
  if (solved_at_ == point && assembly_.has_dynamics(point)) return;
  prepare(s);
  const int n = assembly_.n(), m = assembly_.m();
  double* x = solution_.data();
  for (int i = 0; i < n; ++i) x[i] = assembly_.Q[i];
  calc_constraint_bias(s.v, x + n);
  for (int i = 0; i < m; ++i) x[n + i] = -x[n + i];
  const auto refined = [this](double* b) { kkt_solver_->solve_refined(kkt_.values().data(), b); };
  stabilization_.augmented ? iterate_multipliers(x, n + m, stabilization_.inverse_alpha, refined) : refined(x);
  solved_at_ = point;
}

// A record holds the pivot order, or 0, accelerations and multipliers, and the factorization.
std::size_t AccelerationLevel::record_size() const {
  const std::size_t factors = kkt_solver_->saved_size();
  // Other pivot orders may have more entries; where one does not fit nothing is kept.
  return solved_at_ == 0 ? 0 : 1 + solution_.size() + factors + factors / 4;
}

void AccelerationLevel::keep_record(double* to, std::size_t size) const {
  const bool fits = 1 + solution_.size() + kkt_solver_->saved_size() <= size;
  to[0] = fits ? static_cast<double>(kkt_solver_->pivot_order()) : 0;
  if (!fits) return;
  std::copy(solution_.begin(), solution_.end(), to + 1);
  kkt_solver_->save(to + 1 + solution_.size());
}

bool AccelerationLevel::bring_back(const StateView& s, const double* record) {
  const auto n = static_cast<std::size_t>(assembly_.n()), nz = static_cast<std::size_t>(assembly_.nz());
  const auto order = static_cast<long>(record[0]);
  solved_at_ = 0;
  if (order == 0 || !kkt_solver_->restore(order, record + 1 + solution_.size())) return false;
  brought_back_at_ = point_.move_to(s.t, {{s.q, n}, {s.v, n}, {s.z, nz}});
  std::copy_n(record + 1, solution_.size(), solution_.begin());
  if (assembly_.has_switched_rows()) assembly_.calc_jacobian(state(), brought_back_at_);
  return true;
}

bool AccelerationLevel::brought_back(const StateView& s) {
  const auto n = static_cast<std::size_t>(assembly_.n()), nz = static_cast<std::size_t>(assembly_.nz());
  return brought_back_at_ != 0 && point_.move_to(s.t, {{s.q, n}, {s.v, n}, {s.z, nz}}) == brought_back_at_;
}

template <class Solve>
void AccelerationLevel::iterate_multipliers(double* b, int size, double corner, Solve&& solve) {
  // The matrix with -corner in its lower right block: A x_(i+1) = b - [0; corner lambda_i] tends to the solution
  // without that block; the error falls by about |M| / alpha a turn.
  constexpr int max_iterations = 60;
  constexpr double kGrowsOn = 0.9;
  const int m = assembly_.m(), above = size - m;
  augmented_right_.assign(b, b + size);
  augmented_last_.assign(static_cast<std::size_t>(m), 0.0);
  double before = HUGE_VAL;
  for (int i = 0; i < max_iterations; ++i) {
    std::copy(augmented_right_.begin(), augmented_right_.end(), b);
    for (int r = 0; r < m; ++r)
      if (assembly_.is_there(r)) b[above + r] -= corner * augmented_last_[r];
    solve(b);
    double change = 0, largest = 0;
    for (int r = 0; r < m; ++r) {
      change = std::max(change, std::abs(b[above + r] - augmented_last_[r]));
      largest = std::max(largest, std::abs(b[above + r]));
      augmented_last_[r] = b[above + r];
    }
    // Converged to rounding, or no longer improving because of it. Or what is left is of rows that depend on others,
    // but for what the state is off those by: their multipliers grow turn by turn, up to those of a mechanism that is
    // stuck.
    if (!(change > 4e-16 * largest) || change >= (change < 1e-10 * largest ? 1 : kGrowsOn) * before) break;
    before = change;
  }
}

void AccelerationLevel::solve_kkt(double* b, int columns) {
  if (!stabilization_.augmented) return kkt_solver_->solve(b, columns);
  const int size = assembly_.n() + assembly_.m();
  for (int c = 0; c < columns; ++c, b += size)
    iterate_multipliers(b, size, stabilization_.inverse_alpha, [this](double* x) { kkt_solver_->solve(x); });
}

void AccelerationLevel::solve_kkt_transposed(double* b) {
  if (assembly_.sliding_rows().empty()) return solve_kkt(b);
  if (!stabilization_.augmented) return kkt_solver_->solve_transposed(b);
  iterate_multipliers(b, assembly_.n() + assembly_.m(), stabilization_.inverse_alpha,
                      [this](double* x) { kkt_solver_->solve_transposed(x); });
}

StateView AccelerationLevel::state() const {
  const auto n = assembly_.n();
  StateView s;
  s.t = point_.t();
  s.q = point_.values();
  s.v = s.q + n;
  s.z = s.v + n;
  s.a = a();
  s.lambda = lambda();
  return s;
}

void AccelerationLevel::linearize(const StateView& s, long point) {
  if (stabilized_at_ == point && assembly_.has_partials(point)) return;
  assembly_.calc_partials(s, point);
  const double d = stabilization_.by_rate(), k = stabilization_.by_value();
  for (std::size_t i = 0; i < r2_q_.size(); ++i) {
    const bool holds = assembly_.holds_position(static_cast<int>(assembly_.jacobian().row[i]));
    r2_q_[i] = assembly_.phidd_q[i] + d * assembly_.phid_q[i] + (holds ? k * assembly_.phi_q[i] : 0);
    r2_v_[i] = 2 * assembly_.phid_q[i] + d * assembly_.phi_q[i];
  }
  add_slip_rates(assembly_, s, r2_v_);
  add_rolling_rates(assembly_, s, r2_v_);
  stabilized_at_ = point;
}

void AccelerationLevel::solve_tangent(const double* const* s, int count, const Assembly::ParameterColumns* c,
                                      double* x) {
  const int n = assembly_.n(), m = assembly_.m();
  const double d = stabilization_.by_rate(), k = stabilization_.by_value();
  std::fill(x, x + static_cast<std::ptrdiff_t>(n + m) * count, 0.0);
  double* xj = x;
  for (int j = 0; j < count; ++j, xj += n + m) {
    const double *q = s[j], *v = q + n, *z = v + n;
    add_force_rows(-1, q, v, z, xj);
    add_constraint_rows(-1, q, v, xj + n);
    if (!c) continue;
    for (int i = 0; i < n; ++i) xj[i] -= c->F(i, j);
    for (int i = 0; i < m; ++i)
      xj[n + i] -= c->phidd(i, j) + d * c->phid(i, j) + (assembly_.holds_position(i) ? k * c->phi(i, j) : 0);
  }
  if (count > 0) solve_kkt(x, count);
}

void AccelerationLevel::add_force_rows(double c, const double* xq, const double* xv, const double* xz,
                                       double* out) const {
  add_products(assembly_.square(), assembly_.K.data(), assembly_.C.data(), c, xq, xv, out);
  if (assembly_.nz() > 0) costate::add_product(assembly_.force_state(), assembly_.Q_z.data(), -c, xz, out);
}

void AccelerationLevel::add_constraint_rows(double c, const double* xq, const double* xv, double* out) const {
  add_products(assembly_.jacobian(), r2_q_.data(), r2_v_.data(), c, xq, xv, out);
}

void AccelerationLevel::add_state_rows(double c, const double* xq, const double* xv, const double* xz,
                                       double* out) const {
  if (assembly_.nz() == 0) return;
  add_products(assembly_.state_force(), assembly_.f_q.data(), assembly_.f_v.data(), c, xq, xv, out);
  costate::add_product(assembly_.state_state(), assembly_.f_z.data(), c, xz, out);
}

void AccelerationLevel::add_transposed(double c, const double* s1, const double* s2, const double* sz, double* oq,
                                       double* ov, double* oz) const {
  add_transposed_products(assembly_.square(), assembly_.K.data(), assembly_.C.data(), c, s1, oq, ov);
  add_transposed_products(assembly_.jacobian(), r2_q_.data(), r2_v_.data(), c, s2, oq, ov);
  if (assembly_.nz() == 0) return;
  add_transposed_product(assembly_.force_state(), assembly_.Q_z.data(), -c, s1, oz);
  if (!sz) return;
  add_transposed_products(assembly_.state_force(), assembly_.f_q.data(), assembly_.f_v.data(), -c, sz, oq, ov);
  add_transposed_product(assembly_.state_state(), assembly_.f_z.data(), -c, sz, oz);
}

void AccelerationLevel::add_mass(double c, const double* x, double* out) const {
  costate::add_product(assembly_.square(), assembly_.M.data(), c, x, out);
}
void AccelerationLevel::add_jacobian(double c, const double* x, double* out) const {
  costate::add_product(assembly_.jacobian(), assembly_.phi_q.data(), c, x, out);
}
void AccelerationLevel::add_jacobian_transposed(double c, const double* x, double* out) const {
  add_transposed_product(assembly_.jacobian(), assembly_.phi_q.data(), c, x, out);
}

void AccelerationLevel::add_reactions(double c, const double* lambda, double* out) const {
  add_transposed_product(assembly_.jacobian(), assembly_.reaction_jacobian().data(), c, lambda, out);
}
void AccelerationLevel::add_reactions_transposed(double c, const double* x, double* out) const {
  costate::add_product(assembly_.jacobian(), assembly_.reaction_jacobian().data(), c, x, out);
}

void AccelerationLevel::factor_newton(double gamma) {
  gamma_ = gamma;
  lambda_scale_ = std::max(1.0, gamma * gamma);
  newton_blocks_.M = assembly_.M;
  newton_blocks_.K = assembly_.K;
  newton_blocks_.phi_q = assembly_.phi_q;
  newton_blocks_.R2_q = r2_q_;
  newton_blocks_.f_q = assembly_.f_q;
  newton_.set_zero();
  newton_.add(newton_square_, assembly_.M.data());
  newton_.add(newton_square_, assembly_.C.data(), gamma);
  newton_.add(newton_square_, assembly_.K.data(), gamma * gamma);
  newton_.add(newton_transposed_, assembly_.reaction_jacobian().data(), lambda_scale_);
  newton_.add(newton_jacobian_, assembly_.phi_q.data());
  newton_.add(newton_jacobian_, r2_v_.data(), gamma);
  newton_.add(newton_jacobian_, r2_q_.data(), gamma * gamma);
  if (newton_corner_ >= 0) newton_.add(newton_corner_, corner(), lambda_scale_);
  if (assembly_.nz() > 0) {
    newton_.add(newton_force_state_, assembly_.Q_z.data(), -gamma);
    newton_.add(newton_state_force_, assembly_.f_v.data(), -gamma);
    newton_.add(newton_state_force_, assembly_.f_q.data(), -gamma * gamma);
    newton_.add(newton_state_state_, assembly_.f_z.data(), -gamma);
    newton_.add_constant(newton_state_identity_, 1.0);
  }
  const int bad = newton_solver_->factor(newton_.values().data());
  if (bad >= 0) singular(bad < assembly_.n() ? bad : std::max(0, bad - assembly_.nz()));
}

void AccelerationLevel::solve_newton(double* u) {
  if (stabilization_.augmented)
    iterate_multipliers(u, newton_size(), stabilization_.inverse_alpha * lambda_scale_,
                        [this](double* x) { newton_solver_->solve(x); });
  else
    newton_solver_->solve(u);
  double* lambda = u + assembly_.n() + assembly_.nz();
  for (int i = 0; i < assembly_.m(); ++i) lambda[i] *= lambda_scale_;
}

void AccelerationLevel::solve_newton_transposed(double* u) {
  double* lambda = u + assembly_.n() + assembly_.nz();
  for (int i = 0; i < assembly_.m(); ++i) lambda[i] *= lambda_scale_;
  if (stabilization_.augmented)
    iterate_multipliers(u, newton_size(), stabilization_.inverse_alpha * lambda_scale_,
                        [this](double* x) { newton_solver_->solve_transposed(x); });
  else
    newton_solver_->solve_transposed(u);
}

}  // namespace costate
