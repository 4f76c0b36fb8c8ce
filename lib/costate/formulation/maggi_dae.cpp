#include "costate/formulation/maggi_dae.h"

#include <algorithm>

#include "costate/analysis/start.h"
#include "costate/assembly/switched_rows_refusal.h"
#include "costate/formulation/maggi_cost.h"
#include "costate/formulation/maggi_event.h"
#include "costate/level/maggi_names.h"

namespace costate {

namespace {
SparsePattern full(int rows, int cols) {
  std::vector<std::pair<int, int>> entries;
  for (int j = 0; j < cols; ++j)
    for (int i = 0; i < rows; ++i) entries.emplace_back(i, j);
  return SparsePattern::from_entries(rows, cols, std::move(entries));
}
}  // namespace

MaggiDae::MaggiDae(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective)
    : SegmentedDae(std::move(mechanism), std::move(parameters), std::move(objective)),
      level_(assembly_),
      newton_(level_),
      kink_(level_),
      f_(level_.freedoms()),
      nz_(assembly_.nz()),
      jacobian_(std::max(1, 3 * f_ + nz_)) {
  refuse_rows_without_place(assembly_);
  append_maggi_unknowns(assembly_.mechanism(), f_, unknowns_);
  if (events_) events_->use(kink_.balance());
  for (int i = 0; i < f_; ++i)
    unknowns_.push_back({"independent." + std::to_string(i) + "_ddot", "", Unknown::Role::acceleration, false, true});
  const int y = 0, yd = f_, z = 2 * f_, w = z + nz_;
  const SparsePattern If = SparsePattern::identity(f_), ff = full(f_, f_), zz = full(nz_, nz_), zxf = full(nz_, f_);
  at_.identity_y = jacobian_.place(If, y, y);
  at_.y_yd = jacobian_.place(If, y, yd);
  at_.identity_yd = jacobian_.place(If, yd, yd);
  at_.yd_w = jacobian_.place(If, yd, w);
  at_.identity_z = jacobian_.place(SparsePattern::identity(nz_), z, z);
  at_.z_y = jacobian_.place(zxf, z, y);
  at_.z_yd = jacobian_.place(zxf, z, yd);
  at_.z_z = jacobian_.place(zz, z, z);
  at_.w_y = jacobian_.place(ff, w, y);
  at_.w_yd = jacobian_.place(ff, w, yd);
  at_.w_z = jacobian_.place(full(f_, nz_), w, z);
  at_.w_w = jacobian_.place(ff, w, w);
  at_.idle = jacobian_.place(SparsePattern::identity(w + f_ > 0 ? 0 : 1), 0, 0);
  jacobian_.finalize();
  linearized_at_.assign(static_cast<std::size_t>(size()) + 1, 0);
  motion_.assign(static_cast<std::size_t>(f_), 0);
}

void MaggiDae::solve_point(double t, const double* y) {
  level_.solve(t, y, y + f_, y + 2 * f_);
  level_.set_accelerations(y + 2 * f_ + nz_);
}

void MaggiDae::linearize_motion(double t, const double* y) {
  level_.solve(t, y, y + f_, y + 2 * f_);
  level_.solve_accelerations();
  level_.linearize();
}

MechanismState MaggiDae::kinematic_state(double t, const double* y) {
  level_.solve(t, y, y + f_, y + 2 * f_);
  return level_.state();
}

MechanismState MaggiDae::mechanism_state(double t, const double* y) {
  solve_point(t, y);
  if (level_.shares()) return level_.shared_state();
  level_.solve_multipliers();
  return level_.state();
}

MechanismState MaggiDae::solved_state(double t, const double* y) {
  level_.solve(t, y, y + f_, y + 2 * f_);
  if (level_.shares()) return level_.shared_state();
  level_.solve_accelerations();
  level_.solve_multipliers();
  return level_.state();
}

// Between an integrator's steps w is interpolated, and where a force is short it does not follow it.
void MaggiDae::solve_unknowns(double t, double* y) {
  level_.solve(t, y, y + f_, y + 2 * f_);
  level_.solve_accelerations();
  const std::vector<int>& independent = level_.independent();
  const StateView s = level_.state();
  for (std::size_t i = 0; i < independent.size(); ++i)
    y[static_cast<std::size_t>(2 * f_ + nz_) + i] = s.a[independent[i]];
}

void MaggiDae::residual(double t, const double* y, const double* yp, double* r) {
  solve_point(t, y);
  level_.solve_multipliers();
  const int w = 2 * f_ + nz_;
  std::copy(yp, yp + size() - f_, r);
  for (int i = 0; i < f_; ++i) {
    r[i] -= y[f_ + i];
    r[f_ + i] -= y[w + i];
    r[w + i] = level_.motion()[i];
  }
  for (int i = static_cast<int>(level_.independent().size()); i < f_; ++i) r[w + i] = y[w + i];  // of places
  for (int i = 0; i < nz_; ++i) r[2 * f_ + i] -= assembly_.zdot[i];
}

void MaggiDae::linearize(double t, const double* y, const double*) {
  linearized_at_[0] = t;
  std::copy(y, y + size(), linearized_at_.begin() + 1);
  require_linearized();
}

void MaggiDae::require_linearized() {
  solve_point(linearized_at_[0], linearized_at_.data() + 1);
  level_.linearize();
}

void MaggiDae::jacobian(double t, const double* y, const double* yp, double cj, double* values) {
  linearize(t, y, yp);
  newton_.form();
  BlockMatrix& J = jacobian_;
  J.set_zero();
  for (int block : {at_.identity_y, at_.identity_yd, at_.identity_z, at_.idle}) J.add_constant(block, cj);
  J.add_constant(at_.y_yd, -1);
  J.add_constant(at_.yd_w, -1);
  J.add(at_.z_y, newton_.Zq().data(), -1);
  J.add(at_.z_yd, newton_.Zv().data(), -1);
  J.add(at_.z_z, newton_.f_z().data(), -1);
  J.add(at_.w_y, newton_.Ky().data());
  J.add(at_.w_yd, newton_.Cy().data());
  J.add(at_.w_z, newton_.force_state().data(), -1);
  J.add(at_.w_w, newton_.My().data());
  std::copy(J.values().begin(), J.values().end(), values);
}

void MaggiDae::factor(double t, const double* y, const double* yp, double cj) {
  linearize(t, y, yp);
  newton_.factor(1 / cj);
}

// With g = 1/cj: dy = g b1 + g dyd, dyd = g b2 + g dw, with b4 in the equations of motion.
void MaggiDae::solve(double* b) {
  const double g = newton_.gamma();
  double *b2 = b + f_, *b3 = b + 2 * f_, *b4 = b3 + nz_;
  std::copy(b2, b2 + f_, motion_.begin());
  for (double* x = b; x != b4; ++x) *x *= g;
  newton_.solve(b, b2, b4, b3);
  for (int i = 0; i < f_; ++i) b4[i] = b2[i] / g - motion_[static_cast<std::size_t>(i)];
  for (int i = 3 * f_ + nz_; i < size(); ++i) b[i] *= g;  // idle
}

void MaggiDae::solve_transposed(double* b) {
  const double g = newton_.gamma();
  double *b2 = b + f_, *b3 = b + 2 * f_, *b4 = b3 + nz_;
  std::copy(b4, b4 + f_, motion_.begin());
  for (int i = 0; i < f_; ++i) b2[i] += b4[i] / g;
  newton_.solve_transposed(b, b2, b4, b3);
  for (double* x = b; x != b4; ++x) *x *= g;
  for (int i = 0; i < f_; ++i) b2[i] -= motion_[static_cast<std::size_t>(i)];
  for (int i = 3 * f_ + nz_; i < size(); ++i) b[i] *= g;
}

void MaggiDae::add_product(double c, const double* x, double* out) {
  require_linearized();
  const double* columns[] = {x};
  // Accelerations come last where contacts slide: of a slip that is slow sigma_v has 1/|w|, and what cancels, also with
  // what `out` has, would take their digits.
  const bool last = level_.slides();
  level_.push(columns, 1, !last, false);
  level_.project(level_.force(0), motion_.data());
  const int w = 2 * f_ + nz_;
  for (int i = static_cast<int>(level_.independent().size()); i < f_ && !last; ++i) motion_[i] = x[w + i];
  for (int i = 0; i < f_; ++i) {
    out[i] -= c * x[f_ + i];
    out[f_ + i] -= c * x[w + i];
    out[w + i] += c * motion_[i];
  }
  const double* My = last ? level_.mass_matrix() : nullptr;
  for (int j = 0; j < f_ && last; ++j)
    for (int i = 0; i < f_; ++i) out[w + i] += c * My[static_cast<std::ptrdiff_t>(j) * f_ + i] * x[w + j];
  for (int i = 0; i < nz_; ++i) out[2 * f_ + i] -= c * level_.state_rate(0)[i];
}

void MaggiDae::add_transposed_product(double c, const double* x, double* out) {
  // x^T F_y dy = -dL - xy^T dyd - xyd^T dw with L of g = 0, sigma = R xw, mu_f = xz
  require_linearized();
  const int w = 2 * f_ + nz_;
  cost_gradient_.set_zero();
  level_.pull(cost_gradient_, false);
  level_.add_force_weight(x + w);
  level_.finish_pull(x + 2 * f_);
  for (int i = 0; i < f_; ++i) {
    out[i] -= c * level_.pulled_y()[i];
    out[f_ + i] -= c * (level_.pulled_yd()[i] + x[i]);
    out[w + i] -= c * (level_.pulled_w()[i] + x[f_ + i]);
  }
  for (int i = static_cast<int>(level_.independent().size()); i < f_; ++i) out[w + i] += c * x[w + i];
  for (int i = 0; i < nz_; ++i) out[2 * f_ + i] -= c * level_.pulled_z()[i];
}

void MaggiDae::parameter_columns(Eigen::MatrixXd& F_rho) {
  require_linearized();
  const int np = assembly_.np(), w = 2 * f_ + nz_;
  if (F_rho.rows() != size() || F_rho.cols() != np) F_rho.resize(size(), np);
  F_rho.setZero();
  zero_column_.assign(static_cast<std::size_t>(size()), 0);
  zero_columns_.assign(static_cast<std::size_t>(np), zero_column_.data());
  level_.push(zero_columns_.data(), np, false, true);
  for (int j = 0; j < np; ++j) {
    level_.project(level_.force(j), F_rho.col(j).data() + w);
    for (int i = 0; i < nz_; ++i) F_rho(2 * f_ + i, j) = -level_.state_rate(j)[i];
  }
}

void MaggiDae::add_parameter_gradient(double c, const double* mu, double* gradient) {
  require_linearized();
  cost_gradient_.set_zero();
  level_.pull(cost_gradient_, false);
  level_.add_force_weight(mu + 2 * f_ + nz_);
  level_.finish_pull(mu + 2 * f_);
  level_.add_pulled_parameters(-c, gradient);
}

void MaggiDae::load_state(const StateView& s, double* y, double* yp) const {
  const auto& independent = level_.independent();
  const int w = 2 * f_ + nz_;
  for (int i = 0; i < f_; ++i) {
    yp[w + i] = 0;
    if (static_cast<std::size_t>(i) >= independent.size()) {
      y[f_ + i] = yp[i] = y[w + i] = yp[f_ + i] = 0;
      continue;
    }
    const int k = independent[i];
    y[i] = s.q[k];
    y[f_ + i] = yp[i] = s.v[k];
    y[w + i] = yp[f_ + i] = s.a[k];
  }
  for (int i = 0; i < nz_; ++i) {
    y[2 * f_ + i] = s.z[i];
    yp[2 * f_ + i] = assembly_.zdot[i];
  }
}

void MaggiDae::solve_pushed_accelerations(int j, Eigen::VectorXd& da) {
  level_.project(level_.force(j), motion_.data());
  for (double& x : motion_) x = -x;
  level_.solve_mass(motion_.data());
  da.resize(assembly_.n());
  level_.expand(motion_.data(), da.data());
  for (int i = 0; i < assembly_.n(); ++i) da[i] += level_.da(j)[i];
}

void MaggiDae::spread_start_weights(const StateView& start, const double* mu, double* w_q, double* w_v, double* w_z,
                                    double* gradient) {
  pull_coordinates(level_, start, mu, w_q, w_v, gradient);
  std::copy_n(mu + 2 * f_, nz_, w_z);
}

void MaggiDae::start(double t, double* y, double* yp, Eigen::MatrixXd* y_rho, Eigen::MatrixXd* yp_rho) {
  const Start s = find_start(assembly_, t, y_rho != nullptr);
  level_.start(s.state(t));
  rename();
  std::fill(y, y + size(), 0.0);
  std::fill(yp, yp + size(), 0.0);
  read_coordinates(level_, s.state(t), y);
  std::copy_n(s.z.data(), nz_, y + 2 * f_);
  level_.solve(t, y, y + f_, y + 2 * f_);
  level_.solve_accelerations();
  load_state(level_.state(), y, yp);
  if (!y_rho) return;
  const int np = assembly_.np();
  y_rho->setZero(size(), np);
  yp_rho->setZero(size(), np);
  push_start(level_, s, t, *y_rho);
  std::vector<double*> columns, rates;
  for (int j = 0; j < np; ++j) {
    columns.push_back(y_rho->col(j).data());
    rates.push_back(yp_rho->col(j).data());
  }
  linearize_motion(t, y);
  complete_columns(columns.data(), rates.data(), np);
}

void MaggiDae::complete_columns(double* const* s, double* const* sp, int count) {
  const std::vector<int>& independent = level_.independent();
  const int w = 2 * f_ + nz_;
  level_.push(s, count, false, true);
  Eigen::VectorXd da;
  for (int j = 0; j < count; ++j) {
    solve_pushed_accelerations(j, da);
    for (int i = 0; i < f_; ++i) {
      sp[j][i] = s[j][f_ + i];
      s[j][w + i] = sp[j][f_ + i] = static_cast<std::size_t>(i) < independent.size() ? da[independent[i]] : 0;
      sp[j][w + i] = 0;
    }
    std::copy_n(level_.state_rate(j), nz_, sp[j] + 2 * f_);
  }
}

void MaggiDae::copy_pulled(double c, double* out) const {
  for (int i = 0; i < f_; ++i) {
    out[i] = c * level_.pulled_y()[i];
    out[f_ + i] = c * level_.pulled_yd()[i];
    out[2 * f_ + nz_ + i] = c * level_.pulled_w()[i];
  }
  for (int i = 0; i < nz_; ++i) out[2 * f_ + i] = c * level_.pulled_z()[i];
  for (int i = 3 * f_ + nz_; i < size(); ++i) out[i] = 0;
}

void MaggiDae::pull_cost(bool terminal) {
  cost_gradient_.set_zero();
  add_maggi_cost_gradient(level_, objective_, terminal, cost_gradient_);
  level_.pull(cost_gradient_,
              terminal ? objective_.terminal_needs_accelerations() : objective_.running_needs_accelerations());
}

void MaggiDae::running_cost_gradient(double t, const double* y, double* g_y, double c, double* gradient) {
  solve_point(t, y);
  level_.linearize();
  pull_cost(false);
  level_.finish_pull(nullptr);
  copy_pulled(1, g_y);
  if (!gradient) return;
  for (int j = 0; j < assembly_.np(); ++j) gradient[j] += c * cost_gradient_.rho[j];
  level_.add_pulled_parameters(c, gradient);
}

void MaggiDae::terminal_cost_gradient(double t, const double* y, double* w_y, double c, double* gradient) {
  linearize_motion(t, y);  // as psi is formed, and terminal_adjoint()
  pull_cost(true);
  if (objective_.terminal_needs_accelerations()) level_.eliminate_accelerations(nullptr);
  level_.finish_pull(nullptr);
  copy_pulled(1, w_y);
  for (int j = 0; j < assembly_.np(); ++j) gradient[j] += c * cost_gradient_.rho[j];
  level_.add_pulled_parameters(c, gradient);
}

void MaggiDae::complete_adjoint(double* mu, double* mup) {
  pull_cost(false);
  level_.eliminate_accelerations(mu + f_, mu + 2 * f_ + nz_);
  level_.finish_pull(mu + 2 * f_);
  copy_pulled(-1, mup);
  for (int i = 0; i < f_; ++i) {
    mup[f_ + i] -= mu[i];
    mup[2 * f_ + nz_ + i] = 0;
  }
}

void MaggiDae::terminal_adjoint(double t, const double* y, const double*, double* mu, double* mup, double* gradient) {
  linearize_motion(t, y);
  pull_cost(true);
  if (objective_.terminal_needs_accelerations()) level_.eliminate_accelerations(nullptr);
  level_.finish_pull(nullptr);
  copy_pulled(1, mu);
  for (int j = 0; j < assembly_.np(); ++j) gradient[j] += cost_gradient_.rho[j];
  level_.add_pulled_parameters(1, gradient);
  complete_adjoint(mu, mup);
}
}  // namespace costate
