#include "costate/formulation/index2_dae.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/assembly/slip_directions.h"
#include "costate/base/error.h"
#include "costate/formulation/cost_pullback.h"
#include "costate/level/solved_end.h"
#include "costate/level/unknown_names.h"

namespace costate {

Index2Dae::Index2Dae(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective)
    : DaeSystem(std::move(mechanism), std::move(parameters), std::move(objective)),
      level_(assembly_, Stabilization{}),
      state_(assembly_, level_, 3 * assembly_.n() + assembly_.nz() + 2 * assembly_.m()),
      jacobian_(3 * assembly_.n() + assembly_.nz() + 2 * assembly_.m()),
      n_(assembly_.n()),
      m_(assembly_.m()),
      nz_(assembly_.nz()),
      point_(assembly_) {
  append_differential_unknowns(assembly_.mechanism(), unknowns_);
  append_algebraic_unknowns(assembly_.mechanism(), unknowns_, false);
  if (events_) events_->use(state_.balance());
  for (const auto& name : assembly_.mechanism().row_names())
    unknowns_.push_back({"gamma." + name, "1", Unknown::Role::stabilizer, false, false});
  hessian_.assign(assembly_.square().row.size(), 0);
  place_jacobian();
  solver_ = std::make_unique<KluSolver>(jacobian_.pattern());
}

// What a running cost says of accelerations and reactions is a constraint of the adjoint, which jumps where they do: no
// step of a run back leads across.
void Index2Dae::set_parameters(const double* rho) {
  DaeSystem::set_parameters(rho);
  if (m_ > 0 && objective_.running_needs_accelerations())
    add_kinks(jump_times(assembly_.mechanism(), objective_, assembly_.numbers()));
}

void Index2Dae::place_jacobian() {
  const int q = 0, v = n_, z = 2 * n_, a = z + nz_, l = a + n_, g = l + m_;
  const SparsePattern In = SparsePattern::identity(n_), Iz = SparsePattern::identity(nz_);
  at_.identity_q = jacobian_.place(In, q, q);
  at_.hessian = jacobian_.place(assembly_.square(), q, q);
  at_.q_v = jacobian_.place(In, q, v);
  at_.phi_gamma = jacobian_.place(assembly_.jacobian(), q, g, true);
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
  at_.phi_lambda = jacobian_.place(assembly_.jacobian(), a, l, true);
  at_.phid_q = jacobian_.place(assembly_.jacobian(), l, q);
  at_.phid_v = jacobian_.place(assembly_.jacobian(), l, v);
  at_.phi_q = jacobian_.place(assembly_.jacobian(), g, q);
  if (assembly_.has_switched_rows()) {
    at_.corner = jacobian_.place(level_.corner_pattern(), l, l);
    at_.gamma_corner = jacobian_.place(SparsePattern::identity(m_), g, g);
    for (auto* x : {&gamma_corner_, &position_weights_, &friction_weights_}) x->assign(static_cast<std::size_t>(m_), 0);
  }
  kept_gamma_.assign(static_cast<std::size_t>(m_), 0);
  no_rates_.assign(static_cast<std::size_t>(n_), 0);
  jacobian_.finalize();
}

// A row that is not there has the multiplier 0, or of a contact that slides that of friction: R2's corner stands in the
// place of Phidot = 0, and -gamma = 0 in that of Phi = 0, where also a row has it that keeps rates alone.
const std::vector<double>& Index2Dae::kept_jacobian() {
  if (!assembly_.has_switched_rows()) return assembly_.phi_q;
  kept_q_ = assembly_.phi_q;
  for (std::size_t k = 0; k < kept_q_.size(); ++k)
    if (!kept(static_cast<int>(assembly_.jacobian().row[k]))) kept_q_[k] = 0;
  return kept_q_;
}

MechanismState Index2Dae::solved_state(double t, const double* y) {
  level_.solve(view(t, y));
  return level_.state();
}

void Index2Dae::residual(double t, const double* y, const double* yp, double* r) {
  const StateView s = view(t, y);
  assembly_.calc_dynamics(s);
  const double* gamma = s.lambda + m_;
  double *rv = r + n_, *rz = r + 2 * n_, *ra = rz + nz_, *rl = ra + n_, *rg = rl + m_;
  for (int i = 0; i < n_; ++i) {
    r[i] = yp[i] - s.v[i];
    rv[i] = yp[n_ + i] - s.a[i];
    ra[i] = -assembly_.Q[i];
  }
  for (int i = 0; i < nz_; ++i) rz[i] = yp[2 * n_ + i] - assembly_.zdot[i];
  costate::add_transposed_product(assembly_.jacobian(), kept_jacobian().data(), 1, gamma, r);
  level_.add_mass(1, s.a, ra);
  level_.add_reactions(1, s.lambda, ra);
  for (int i = 0; i < m_; ++i) {
    rl[i] = assembly_.phi_t[i];
    rg[i] = (kept(i) ? assembly_.phi[i] : 0) + level_.stabilizer_corner(i) * gamma[i];
  }
  level_.add_jacobian(1, s.v, rl);
  level_.add_corner(1, s.lambda, rl);
}

void Index2Dae::linearize(double t, const double* y, const double*) {
  const long point = point_.move_to(t, {{y, static_cast<std::size_t>(size())}});
  if (hessian_at_ == point && assembly_.has_matrices(point) && assembly_.has_partials(point)) return;
  const StateView s = view(t, point_.values());
  // Of the values only M and Phi_q stand in the products: forces are not evaluated.
  assembly_.calc_mass(s, point);
  assembly_.calc_jacobian(s, point);
  assembly_.calc_partials(s, point);
  slip_partials(assembly_, s, slip_q_, slip_v_);
  assembly_.calc_hessian(s, s.lambda + m_, hessian_);
  hessian_at_ = point;
}

void Index2Dae::add_slips(double c, const double* xq, const double* xv, double* out) const {
  if (slip_q_.empty()) return;
  costate::add_product(assembly_.jacobian(), slip_q_.data(), c, xq, out);
  costate::add_product(assembly_.jacobian(), slip_v_.data(), c, xv, out);
}

void Index2Dae::add_slips_transposed(double c, const double* x, double* oq, double* ov) const {
  if (slip_q_.empty()) return;
  costate::add_transposed_product(assembly_.jacobian(), slip_q_.data(), c, x, oq);
  costate::add_transposed_product(assembly_.jacobian(), slip_v_.data(), c, x, ov);
}

void Index2Dae::fill_jacobian(double cj) {
  BlockMatrix& J = jacobian_;
  J.set_zero();
  for (int block : {at_.identity_q, at_.identity_v, at_.identity_z}) J.add_constant(block, cj);
  J.add(at_.hessian, hessian_.data());
  J.add_constant(at_.q_v, -1);
  const std::vector<double>& kept_q = kept_jacobian();
  J.add(at_.phi_gamma, kept_q.data());
  J.add_constant(at_.v_a, -1);
  J.add(at_.z_q, assembly_.f_q.data(), -1);
  J.add(at_.z_v, assembly_.f_v.data(), -1);
  J.add(at_.z_z, assembly_.f_z.data(), -1);
  J.add(at_.K, assembly_.K.data());
  J.add(at_.C, assembly_.C.data());
  J.add(at_.Q_z, assembly_.Q_z.data(), -1);
  J.add(at_.M, assembly_.M.data());
  J.add(at_.phi_lambda, assembly_.reaction_jacobian().data());
  J.add(at_.phid_q, assembly_.phid_q.data());
  J.add(at_.phid_v, assembly_.phi_q.data());
  J.add(at_.phi_q, kept_q.data());
  if (!slip_q_.empty()) {
    J.add(at_.phid_q, slip_q_.data());
    J.add(at_.phid_v, slip_v_.data());
  }
  if (at_.corner < 0) return;
  J.add(at_.corner, level_.corner());
  for (int i = 0; i < m_; ++i) gamma_corner_[static_cast<std::size_t>(i)] = level_.stabilizer_corner(i);
  J.add(at_.gamma_corner, gamma_corner_.data());
}

void Index2Dae::jacobian(double t, const double* y, const double* yp, double cj, double* values) {
  linearize(t, y, yp);
  fill_jacobian(cj);
  std::copy(jacobian_.values().begin(), jacobian_.values().end(), values);
}

void Index2Dae::factor(double t, const double* y, const double* yp, double cj) {
  linearize(t, y, yp);
  fill_jacobian(cj);
  scale_jacobian(cj);
  const int bad = solver_->factor(jacobian_.values().data());
  if (bad >= 0)
    throw SolverError(
        fmt::format("The Newton matrix of the stabilised index-2 equations is singular at t = {:.9g} s, "
                    "at unknown '{}'. Redundant joints or a singular configuration: penalty and "
                    "augmented-lagrangian carry both, maggi the former.",
                    t, unknowns_[bad].name));
}

// With s = |cj| > 1 the unknowns a, lambda and gamma are measured in units of s, and the rows of differential equations
// and of forces divided by it: the blocks then are I, M and Phi_q plus terms of size 1/s.
void Index2Dae::scale_rows(double* x) const {
  const double s = 1 / cj_scale_;
  for (int i = 0; i < 3 * n_ + nz_; ++i) x[i] *= s;
}
void Index2Dae::scale_columns(double* x) const {
  for (int i = 2 * n_ + nz_; i < size(); ++i) x[i] *= cj_scale_;
}

void Index2Dae::scale_jacobian(double cj) {
  cj_scale_ = std::max(1.0, std::abs(cj));
  if (cj_scale_ == 1) return;
  const SparsePattern& p = jacobian_.pattern();
  double* x = jacobian_.values_data();
  for (int j = 0; j < p.cols; ++j) {
    const double lower = j < 2 * n_ + nz_ ? 1 : cj_scale_, upper = lower / cj_scale_;
    for (auto k = p.column_start[j]; k < p.column_start[j + 1]; ++k) x[k] *= p.row[k] < 3 * n_ + nz_ ? upper : lower;
  }
}

void Index2Dae::solve(double* b) {
  scale_rows(b);
  solver_->solve(b);
  scale_columns(b);
}

void Index2Dae::solve_transposed(double* b) {
  scale_columns(b);
  solver_->solve_transposed(b);
  scale_rows(b);
}

void Index2Dae::add_product(double c, const double* x, double* out) {
  const double *xv = x + n_, *xz = x + 2 * n_, *xa = xz + nz_, *xl = xa + n_, *xg = xl + m_;
  double *ov = out + n_, *oz = out + 2 * n_, *oa = oz + nz_, *ol = oa + n_, *og = ol + m_;
  for (int i = 0; i < n_; ++i) {
    out[i] -= c * xv[i];
    ov[i] -= c * xa[i];
  }
  costate::add_product(assembly_.square(), hessian_.data(), c, x, out);
  const std::vector<double>& kept_q = kept_jacobian();
  costate::add_transposed_product(assembly_.jacobian(), kept_q.data(), c, xg, out);
  level_.add_state_rows(-c, x, xv, xz, oz);
  level_.add_force_rows(c, x, xv, xz, oa);
  level_.add_mass(c, xa, oa);
  level_.add_reactions(c, xl, oa);
  costate::add_product(assembly_.jacobian(), assembly_.phid_q.data(), c, x, ol);
  level_.add_jacobian(c, xv, ol);
  level_.add_corner(c, xl, ol);
  add_slips(c, x, xv, ol);
  costate::add_product(assembly_.jacobian(), kept_q.data(), c, x, og);
  for (int i = 0; i < m_; ++i) og[i] += c * level_.stabilizer_corner(i) * xg[i];
}

void Index2Dae::add_transposed_product(double c, const double* x, double* out) {
  const double *xv = x + n_, *xz = x + 2 * n_, *xa = xz + nz_, *xl = xa + n_, *xg = xl + m_;
  double *ov = out + n_, *oz = out + 2 * n_, *oa = oz + nz_, *ol = oa + n_, *og = ol + m_;
  for (int i = 0; i < n_; ++i) {
    ov[i] -= c * x[i];
    oa[i] -= c * xv[i];
  }
  costate::add_transposed_product(assembly_.square(), hessian_.data(), c, x, out);
  const std::vector<double>& kept_q = kept_jacobian();
  costate::add_product(assembly_.jacobian(), kept_q.data(), c, x, og);
  costate::add_transposed_product(assembly_.square(), assembly_.K.data(), c, xa, out);
  costate::add_transposed_product(assembly_.square(), assembly_.C.data(), c, xa, ov);
  if (nz_ > 0) {
    costate::add_transposed_product(assembly_.force_state(), assembly_.Q_z.data(), -c, xa, oz);
    costate::add_transposed_product(assembly_.state_force(), assembly_.f_q.data(), -c, xz, out);
    costate::add_transposed_product(assembly_.state_force(), assembly_.f_v.data(), -c, xz, ov);
    costate::add_transposed_product(assembly_.state_state(), assembly_.f_z.data(), -c, xz, oz);
  }
  level_.add_mass(c, xa, oa);
  level_.add_reactions_transposed(c, xa, ol);
  costate::add_transposed_product(assembly_.jacobian(), assembly_.phid_q.data(), c, xl, out);
  level_.add_jacobian_transposed(c, xl, ov);
  level_.add_corner_transposed(c, xl, ol);
  add_slips_transposed(c, xl, out, ov);
  costate::add_transposed_product(assembly_.jacobian(), kept_q.data(), c, xg, out);
  for (int i = 0; i < m_; ++i) og[i] += c * level_.stabilizer_corner(i) * xg[i];
}

void Index2Dae::parameter_columns(Eigen::MatrixXd& F_rho) {
  assembly_.calc_parameter_columns(view(point_.t(), point_.values()), columns_);
  if (F_rho.rows() != size() || F_rho.cols() != assembly_.np()) F_rho.resize(size(), assembly_.np());
  F_rho.setZero();
  // (Phi_q^T gamma)_rho in the first rows vanishes with gamma on the solution.
  if (stage_parameters_) {
    const StateView s = view(point_.t(), point_.values());
    Eigen::MatrixXd normals(n_, assembly_.np());
    assembly_.calc_projection_columns(s, no_rates_.data(), kept_gamma(s), normals);
    F_rho.topRows(n_) = normals;
  }
  F_rho.middleRows(2 * n_, nz_) = -columns_.f;
  F_rho.middleRows(2 * n_ + nz_, n_) = columns_.F;
  F_rho.middleRows(3 * n_ + nz_, m_) = columns_.phid;
  for (const Assembly::SlidingRow& r : assembly_.sliding_rows())
    F_rho.row(3 * n_ + nz_ + r.along) = columns_.phidd.row(r.along);
  F_rho.bottomRows(m_) = columns_.phi;
  for (int i = 0; i < m_; ++i)
    if (!kept(i)) F_rho.row(3 * n_ + nz_ + m_ + i).setZero();
}

void Index2Dae::go_to_parameters(double t, const double* y, const double* yp) {
  if (assembly_.has_switched_rows()) return linearize(t, y, yp);
  point_.move_to(t, {{y, static_cast<std::size_t>(size())}});
}

void Index2Dae::add_parameter_gradient(double c, const double* mu, double* gradient) {
  Assembly::ParameterWeights w;
  w.state = mu + 2 * n_;
  w.force = mu + 2 * n_ + nz_;
  w.row_phid = mu + 3 * n_ + nz_;
  w.row_phi = mu + 3 * n_ + nz_ + m_;
  const StateView s = view(point_.t(), point_.values());
  if (assembly_.has_switched_rows()) {
    for (int i = 0; i < m_; ++i) position_weights_[static_cast<std::size_t>(i)] = kept(i) ? w.row_phi[i] : 0;
    w.row_phi = position_weights_.data();
  }
  if (!assembly_.sliding_rows().empty()) {
    std::fill(friction_weights_.begin(), friction_weights_.end(), 0.0);
    for (const Assembly::SlidingRow& r : assembly_.sliding_rows())
      friction_weights_[static_cast<std::size_t>(r.along)] = w.row_phid[r.along];
    w.row = friction_weights_.data();  // of no other row
    w.c0 = w.c1 = 0;
    w.c2 = 1;
  }
  assembly_.add_parameter_gradient(s, w, c, gradient);
  if (stage_parameters_) assembly_.add_projection_gradient(s, no_rates_.data(), kept_gamma(s), mu, c, gradient, false);
}

const double* Index2Dae::kept_gamma(const StateView& s) {
  for (int i = 0; i < m_; ++i) kept_gamma_[static_cast<std::size_t>(i)] = kept(i) ? s.lambda[m_ + i] : 0;
  return kept_gamma_.data();
}

void Index2Dae::running_cost_gradient(double t, const double* y, double* g_y, double c, double* gradient) {
  std::fill(g_y, g_y + size(), 0.0);
  cost_gradient_.set_zero();
  objective_.add_running_gradient(view(t, y), assembly_, cost_gradient_);
  copy_cost_gradient(cost_gradient_, g_y, c, gradient);
}

void Index2Dae::terminal_cost_gradient(double t, const double* y, double* w_y, double c, double* gradient) {
  std::fill(w_y, w_y + size(), 0.0);
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

void Index2Dae::terminal_adjoint(double t, const double* y, const double*, double* mu, double* mup, double* gradient) {
  StateView s = view(t, y);
  if (objective_.terminal_needs_accelerations()) {  // those that psi is formed with
    level_.solve(s);
    s = level_.state();
  } else {
    level_.prepare(s);
  }
  level_.linearize(s);
  // w^ = w with accelerations and multipliers eliminated.
  cost_gradient_.set_zero();
  objective_.add_terminal_gradient(s, assembly_, cost_gradient_);
  ScalarGradient& g = cost_gradient_;
  for (int j = 0; j < assembly_.np(); ++j) gradient[j] += g.rho[j];
  if (objective_.terminal_needs_accelerations()) eliminate_at_end(level_, assembly_, s, g, 1, gradient);
  const Eigen::VectorXd wz = g.z;
  complete_adjoint(s, g.q, g.v, wz.data(), mu, mup, gradient);
}

}  // namespace costate
