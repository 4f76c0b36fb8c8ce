#include "costate/formulation/acceleration_dae.h"

#include "costate/formulation/cost_pullback.h"
#include "costate/level/solved_end.h"
#include "costate/level/unknown_names.h"

namespace costate {

AccelerationDae::AccelerationDae(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                 Objective objective, Stabilization stabilization)
    : DaeSystem(std::move(mechanism), std::move(parameters), std::move(objective)),
      level_(assembly_, stabilization),
      state_(assembly_, level_, 3 * assembly_.n() + assembly_.nz() + assembly_.m()),
      jacobian_(3 * assembly_.n() + assembly_.nz() + assembly_.m()),
      n_(assembly_.n()),
      m_(assembly_.m()),
      nz_(assembly_.nz()),
      point_(assembly_) {
  append_differential_unknowns(assembly_.mechanism(), unknowns_);
  append_algebraic_unknowns(assembly_.mechanism(), unknowns_, true);
  // By a weight the multipliers of rows that depend on each other are alpha times a difference of roundings, which no
  // iteration makes less. Accelerations hold what there is of them.
  int row = 0;
  for (Unknown& u : unknowns_) {
    if (u.role != Unknown::Role::multiplier) continue;
    if (stabilization.inverse_alpha > 0 || level_.giving_rows().beside(row)) u.in_norm = false;
    ++row;
  }
  if (events_) events_->use(state_.balance());
  reduced_.assign(static_cast<std::size_t>(level_.newton_size()), 0);
  place_jacobian();
}

void AccelerationDae::place_jacobian() {
  const int q = 0, v = n_, z = 2 * n_, a = z + nz_, l = a + n_;
  const SparsePattern In = SparsePattern::identity(n_), Iz = SparsePattern::identity(nz_);
  at_.identity_q = jacobian_.place(In, q, q);
  at_.q_v = jacobian_.place(In, q, v);
  at_.identity_v = jacobian_.place(In, v, v);
  at_.v_a = jacobian_.place(In, v, a);
  at_.identity_z = jacobian_.place(Iz, z, z);
  at_.z_q = jacobian_.place(assembly_.state_force(), z, q);
  at_.z_v = jacobian_.place(assembly_.state_force(), z, v);
  at_.z_z = jacobian_.place(assembly_.state_state(), z, z);
  at_.K = jacobian_.place(assembly_.square(), a, q);
  at_.C = jacobian_.place(assembly_.square(), a, v);
  at_.Q_z = jacobian_.place(assembly_.force_state(), a, z);
  at_.M = jacobian_.place(assembly_.square(), a, a);
  at_.phi_t = jacobian_.place(assembly_.jacobian(), a, l, true);
  at_.R2_q = jacobian_.place(assembly_.jacobian(), l, q);
  at_.R2_v = jacobian_.place(assembly_.jacobian(), l, v);
  at_.phi_q = jacobian_.place(assembly_.jacobian(), l, a);
  at_.corner = level_.has_corner() ? jacobian_.place(level_.corner_pattern(), l, l) : -1;
  jacobian_.finalize();
}

MechanismState AccelerationDae::solved_state(double t, const double* y) {
  level_.solve(view(t, y));
  return level_.state();
}

void AccelerationDae::residual(double t, const double* y, const double* yp, double* r) {
  const StateView s = view(t, y);
  assembly_.calc_dynamics(s);
  double *rv = r + n_, *rz = r + 2 * n_, *ra = rz + nz_, *rl = ra + n_;
  for (int i = 0; i < n_; ++i) {
    r[i] = yp[i] - s.v[i];
    rv[i] = yp[n_ + i] - s.a[i];
    ra[i] = -assembly_.Q[i];
  }
  for (int i = 0; i < nz_; ++i) rz[i] = yp[2 * n_ + i] - assembly_.zdot[i];
  level_.add_mass(1, s.a, ra);
  level_.add_reactions(1, s.lambda, ra);
  level_.calc_constraint_bias(s.v, rl);
  level_.add_jacobian(1, s.a, rl);
  level_.add_corner(1, s.lambda, rl);
}

void AccelerationDae::linearize(double t, const double* y, const double*) {
  const long point = point_.move_to(t, {{y, static_cast<std::size_t>(size())}});
  if (assembly_.has_matrices(point) && assembly_.has_partials(point)) return;
  const StateView s = view(t, point_.values());
  // Of the values only M and Phi_q stand in the products: forces are not evaluated.
  assembly_.calc_mass(s, point);
  assembly_.calc_jacobian(s, point);
  level_.linearize(s, point);
}

void AccelerationDae::jacobian(double t, const double* y, const double* yp, double cj, double* values) {
  linearize(t, y, yp);
  BlockMatrix& J = jacobian_;
  J.set_zero();
  for (int block : {at_.identity_q, at_.identity_v, at_.identity_z}) J.add_constant(block, cj);
  J.add_constant(at_.q_v, -1);
  J.add_constant(at_.v_a, -1);
  J.add(at_.z_q, assembly_.f_q.data(), -1);
  J.add(at_.z_v, assembly_.f_v.data(), -1);
  J.add(at_.z_z, assembly_.f_z.data(), -1);
  J.add(at_.K, assembly_.K.data());
  J.add(at_.C, assembly_.C.data());
  J.add(at_.Q_z, assembly_.Q_z.data(), -1);
  J.add(at_.M, assembly_.M.data());
  J.add(at_.phi_t, assembly_.reaction_jacobian().data());
  J.add(at_.R2_q, level_.R2_q().data());
  J.add(at_.R2_v, level_.R2_v().data());
  J.add(at_.phi_q, assembly_.phi_q.data());
  if (at_.corner >= 0) J.add(at_.corner, level_.corner());
  std::copy(J.values().begin(), J.values().end(), values);
}

void AccelerationDae::factor(double t, const double* y, const double* yp, double cj) {
  linearize(t, y, yp);
  level_.factor_newton(1 / cj);
}

void AccelerationDae::solve(double* b) {
  const auto& blocks = level_.newton_blocks();
  const double g = level_.gamma();
  double *b2 = b + n_, *b3 = b + 2 * n_, *b4 = b3 + nz_, *b5 = b4 + n_;
  double *u = reduced_.data(), *uz = u + n_, *ul = uz + nz_;
  std::fill(reduced_.begin(), reduced_.end(), 0.0);
  for (int i = 0; i < n_; ++i) u[i] = g * b4[i];
  costate::add_product(assembly_.square(), blocks.M.data(), g, b2, u);
  costate::add_product(assembly_.square(), blocks.K.data(), -g * g, b, u);
  for (int i = 0; i < nz_; ++i) uz[i] = g * b3[i];
  if (nz_ > 0) costate::add_product(assembly_.state_force(), blocks.f_q.data(), g * g, b, uz);
  for (int i = 0; i < m_; ++i) ul[i] = g * b5[i];
  costate::add_product(assembly_.jacobian(), blocks.phi_q.data(), g, b2, ul);
  costate::add_product(assembly_.jacobian(), blocks.R2_q.data(), -g * g, b, ul);
  level_.solve_newton(u);
  for (int i = 0; i < n_; ++i) {
    b[i] = g * (b[i] + u[i]);
    b4[i] = u[i] / g - b2[i];
    b2[i] = u[i];
  }
  for (int i = 0; i < nz_; ++i) b3[i] = uz[i];
  for (int i = 0; i < m_; ++i) b5[i] = ul[i] / g;
}

void AccelerationDae::solve_transposed(double* b) {
  const auto& blocks = level_.newton_blocks();
  const double g = level_.gamma();
  double *b2 = b + n_, *b3 = b + 2 * n_, *b4 = b3 + nz_, *b5 = b4 + n_;
  double *u = reduced_.data(), *uz = u + n_, *ul = uz + nz_;
  for (int i = 0; i < n_; ++i) u[i] = b2[i] + g * b[i] + b4[i] / g;
  for (int i = 0; i < nz_; ++i) uz[i] = b3[i];
  for (int i = 0; i < m_; ++i) ul[i] = b5[i] / g;
  level_.solve_newton_transposed(u);
  for (int i = 0; i < n_; ++i) {
    b[i] = g * b[i];
    b2[i] = -b4[i];
    b4[i] = g * u[i];
  }
  costate::add_transposed_product(assembly_.square(), blocks.K.data(), -g * g, u, b);
  costate::add_transposed_product(assembly_.jacobian(), blocks.R2_q.data(), -g * g, ul, b);
  if (nz_ > 0) costate::add_transposed_product(assembly_.state_force(), blocks.f_q.data(), g * g, uz, b);
  costate::add_product(assembly_.square(), blocks.M.data(), g, u, b2);
  costate::add_transposed_product(assembly_.jacobian(), blocks.phi_q.data(), g, ul, b2);
  for (int i = 0; i < nz_; ++i) b3[i] = g * uz[i];
  for (int i = 0; i < m_; ++i) b5[i] = g * ul[i];
}

void AccelerationDae::add_product(double c, const double* x, double* out) {
  const double *xv = x + n_, *xz = x + 2 * n_, *xa = xz + nz_, *xl = xa + n_;
  double *ov = out + n_, *oz = out + 2 * n_, *oa = oz + nz_, *ol = oa + n_;
  for (int i = 0; i < n_; ++i) {
    out[i] -= c * xv[i];
    ov[i] -= c * xa[i];
  }
  level_.add_state_rows(-c, x, xv, xz, oz);
  level_.add_force_rows(c, x, xv, xz, oa);
  level_.add_mass(c, xa, oa);
  level_.add_reactions(c, xl, oa);
  level_.add_constraint_rows(c, x, xv, ol);
  level_.add_jacobian(c, xa, ol);
  level_.add_corner(c, xl, ol);
}

void AccelerationDae::add_transposed_product(double c, const double* x, double* out) {
  const double *xv = x + n_, *xz = x + 2 * n_, *xa = xz + nz_, *xl = xa + n_;
  double *ov = out + n_, *oz = out + 2 * n_, *oa = oz + nz_, *ol = oa + n_;
  for (int i = 0; i < n_; ++i) {
    ov[i] -= c * x[i];
    oa[i] -= c * xv[i];
  }
  level_.add_transposed(c, xa, xl, xz, out, ov, oz);
  level_.add_mass(c, xa, oa);  // symmetric
  level_.add_jacobian_transposed(c, xl, oa);
  level_.add_reactions_transposed(c, xa, ol);
  level_.add_corner_transposed(c, xl, ol);
}

void AccelerationDae::parameter_columns(Eigen::MatrixXd& F_rho) {
  assembly_.calc_parameter_columns(view(point_.t(), point_.values()), columns_);
  if (F_rho.rows() != size() || F_rho.cols() != assembly_.np()) F_rho.resize(size(), assembly_.np());
  F_rho.setZero();
  F_rho.middleRows(2 * n_, nz_) = -columns_.f;
  F_rho.middleRows(2 * n_ + nz_, n_) = columns_.F;
  F_rho.bottomRows(m_) = level_.constraint_columns(columns_);
}

void AccelerationDae::add_parameter_gradient(double c, const double* mu, double* gradient) {
  const double *mu_z = mu + 2 * n_, *s1 = mu_z + nz_;
  assembly_.add_parameter_gradient(view(point_.t(), point_.values()), level_.stabilization().weights(s1, s1 + n_, mu_z),
                                   c, gradient);
}

void AccelerationDae::go_to_parameters(double t, const double* y, const double* yp) {
  if (assembly_.has_switched_rows()) return linearize(t, y, yp);
  point_.move_to(t, {{y, static_cast<std::size_t>(size())}});
}

void AccelerationDae::start(double t, double* y, double* yp, Eigen::MatrixXd* y_rho, Eigen::MatrixXd* yp_rho) {
  const Start s = state_.start(t, y_rho != nullptr, y, yp);
  if (!y_rho) return;
  const int np = assembly_.np();
  y_rho->setZero(size(), np);
  yp_rho->setZero(size(), np);
  y_rho->topRows(2 * n_ + nz_) << s.q_rho, s.v_rho, s.z_rho;
  std::vector<double*> columns, rates;
  for (int j = 0; j < np; ++j) {
    columns.push_back(y_rho->col(j).data());
    rates.push_back(yp_rho->col(j).data());
  }
  state_.complete_columns(columns.data(), rates.data(), np);
}

void AccelerationDae::jump(double t, double* y, double* yp) {
  if (pending_event_ >= 0) {
    events_->cross(pending_event_, view(t, y), y + n_, y + 2 * n_);
    state_.complete(t, y, yp);
    return;
  }
  state_.jump(t, segment_start(t), y, yp);
}

void AccelerationDae::jump_tangent(const Jump& jump, double* const* s, double* const* sp, int count) {
  std::vector<double> y = jump.y, yp = jump.yp;
  jump_cost_tangent_.clear();
  if (jump.event >= 0) {
    jump_cost_tangent_.assign(static_cast<std::size_t>(count), 0);
    const StateView before = view(jump.t, jump.y.data());
    events_->cross(jump.event, before, y.data() + n_, y.data() + 2 * n_);
    const auto minus = event_side(jump.t, jump.y.data()), plus = event_side(jump.t, y.data());
    events_->tangent(jump.event, before, minus, plus, s, count, jump_cost_tangent_.data());
    state_.complete(jump.t, y.data(), yp.data());
    state_.complete_columns(s, sp, count);
    return;
  }
  const auto moving = moving_time(
      jump, [&](double* after, double* rates) { state_.jump(jump.t, segment_start(jump.t), after, rates); });
  set_cost_tangent(moving);
  state_.jump_tangent(jump.t, segment_start(jump.t), y.data(), yp.data(), s, count, moving ? &*moving : nullptr);
  state_.complete_columns(s, sp, count);
}

void AccelerationDae::jump_adjoint(const Jump& jump, double* mu, double* mup, double* gradient) {
  if (jump.event >= 0) {
    std::vector<double> after = jump.y;
    const StateView before = view(jump.t, jump.y.data());
    events_->cross(jump.event, before, after.data() + n_, after.data() + 2 * n_);
    const auto minus = event_side(jump.t, jump.y.data()), plus = event_side(jump.t, after.data());
    events_->adjoint(jump.event, before, minus, plus, mu, gradient);
  } else {
    const auto moving = moving_time(
        jump, [&](double* after, double* rates) { state_.jump(jump.t, segment_start(jump.t), after, rates); });
    state_.jump_adjoint(jump.t, segment_start(jump.t), jump.y.data(), mu, gradient, moving ? &*moving : nullptr);
  }
  const std::vector<double> w(mu, mu + 2 * n_ + nz_);
  adjoint_at(jump.t, jump.y.data(), w.data(), mu, mup, gradient);
}

void AccelerationDae::adjoint_at(double t, const double* y, const double* w, double* mu, double* mup, double*) {
  std::copy(w, w + 2 * n_ + nz_, mu);
  const StateView s = view(t, y);
  level_.prepare(s);
  level_.linearize(s);
  complete_adjoint(s, mu, mup);
}

void AccelerationDae::running_cost_gradient(double t, const double* y, double* g_y, double c, double* gradient) {
  cost_gradient_.set_zero();
  objective_.add_running_gradient(view(t, y), assembly_, cost_gradient_);
  copy_cost_gradient(cost_gradient_, g_y, c, gradient);
}

void AccelerationDae::terminal_cost_gradient(double t, const double* y, double* w_y, double c, double* gradient) {
  if (!objective_.terminal_needs_accelerations()) {
    cost_gradient_.set_zero();
    objective_.add_terminal_gradient(view(t, y), assembly_, cost_gradient_);
    return copy_cost_gradient(cost_gradient_, w_y, c, gradient);
  }
  // As psi is formed: with accelerations and multipliers solved for. Columns of (q, v, z) remain.
  level_.solve(view(t, y));
  const StateView s = level_.state();
  level_.linearize();
  cost_gradient_.set_zero();
  objective_.add_terminal_gradient(s, assembly_, cost_gradient_);
  ScalarGradient& g = cost_gradient_;
  eliminate_at_end(level_, assembly_, s, g, c, gradient);
  g.a.setZero();
  g.lambda.setZero();
  copy_cost_gradient(g, w_y, c, gradient);
}

void AccelerationDae::terminal_adjoint(double t, const double* y, const double*, double* mu, double* mup,
                                       double* gradient) {
  StateView s = view(t, y);
  if (objective_.terminal_needs_accelerations()) {  // those that psi is formed with
    level_.solve(s);
    s = level_.state();
  } else {
    level_.prepare(s);
  }
  level_.linearize(s);
  // Terminal part, accelerations and multipliers eliminated.
  cost_gradient_.set_zero();
  objective_.add_terminal_gradient(s, assembly_, cost_gradient_);
  ScalarGradient& g = cost_gradient_;
  for (int j = 0; j < assembly_.np(); ++j) gradient[j] += g.rho[j];
  if (objective_.terminal_needs_accelerations()) eliminate_at_end(level_, assembly_, s, g, 1, gradient);
  std::copy(g.q.data(), g.q.data() + n_, mu);
  std::copy(g.v.data(), g.v.data() + n_, mu + n_);
  std::copy(g.z.data(), g.z.data() + nz_, mu + 2 * n_);
  complete_adjoint(s, mu, mup);
}

// Algebraic part: KKT [s1; s2] = [mu_v + g_a; g_l], and the derivatives from the differential rows.
void AccelerationDae::complete_adjoint(const StateView& s, double* mu, double* mup) {
  std::vector<double> kkt(static_cast<std::size_t>(n_ + m_));
  double *mv = mu + n_, *mz = mu + 2 * n_, *s1 = mz + nz_, *s2 = s1 + n_;
  ScalarGradient& g = cost_gradient_;
  cost_gradient_.set_zero();
  objective_.add_running_gradient(s, assembly_, cost_gradient_);
  for (int i = 0; i < n_; ++i) kkt[i] = mv[i] + g.a[i];
  for (int i = 0; i < m_; ++i) kkt[n_ + i] = g.lambda[i];
  level_.solve_kkt_transposed(kkt.data());
  std::copy(kkt.begin(), kkt.begin() + n_, s1);
  std::copy(kkt.begin() + n_, kkt.end(), s2);
  std::fill(mup, mup + size(), 0.0);
  for (int i = 0; i < n_; ++i) {
    mup[i] = -g.q[i];
    mup[n_ + i] = -g.v[i] - mu[i];
  }
  for (int i = 0; i < nz_; ++i) mup[2 * n_ + i] = -g.z[i];
  level_.add_transposed(1, s1, s2, mz, mup, mup + n_, mup + 2 * n_);
}

}  // namespace costate
