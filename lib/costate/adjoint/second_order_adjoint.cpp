#include "costate/adjoint/second_order_adjoint.h"

#include "costate/adjoint/gradient_rate.h"
#include "costate/analysis/start.h"
#include "costate/assembly/reaction_rates.h"
#include "costate/assembly/rolling_rows.h"
#include "costate/assembly/sliding_terms.h"
#include "costate/assembly/slip_directions.h"
#include "costate/base/error.h"
#include "costate/linear/to_dense.h"

namespace costate {

namespace {
SparsePattern full(int rows, int cols) {
  std::vector<std::pair<int, int>> e;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < cols; ++j) e.emplace_back(i, j);
  return SparsePattern::from_entries(rows, cols, std::move(e));
}
}  // namespace

SecondOrderAdjoint::SecondOrderAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                       Objective objective, Stabilization stabilization)
    : HandEquations(std::move(mechanism), std::move(parameters), std::move(objective), stabilization,
                    Direction::backward) {
  const auto coordinates = assembly_.mechanism().coordinate_names();
  const auto rows = assembly_.mechanism().row_names();
  add_rows("mu.", coordinates, true);
  add_rows("mu_dot.", coordinates, true);
  add_rows("mu_z.", assembly_.mechanism().state_names(), true);
  add_rows("sigma.", rows, true);
  add_rows("tau.", rows, false);
  const int u = 0, v = n_, z = 2 * n_, s = z + nz_, t = s + m_;
  const SparsePattern In = SparsePattern::identity(n_), Iz = SparsePattern::identity(nz_),
                      Im = SparsePattern::identity(m_);
  at_.D_mu = place(In, u, u);
  at_.D_nu = place(assembly_.square(), v, v);
  at_.D_tau = place(assembly_.jacobian(), v, t, true);
  at_.D_z = place(Iz, z, z);
  at_.mu_nu = place(In, u, v);
  at_.nu_M1 = place(assembly_.square(), v, v);
  at_.nu_C = place(assembly_.square(), v, v, true);
  at_.nu_mu = place(assembly_.square(), v, u);
  at_.nu_mu_t = place(assembly_.square(), v, u, true);
  at_.nu_tau = place(assembly_.jacobian(), v, t, true);
  at_.nu_sigma = place(assembly_.jacobian(), v, s, true);
  at_.nu_z = place(assembly_.state_force(), v, z, true);
  at_.z_mu = place(assembly_.force_state(), z, u, true);
  at_.z_z = place(assembly_.state_state(), z, z, true);
  at_.D_sigma = place(Im, s, s);
  at_.sigma_tau = place(Im, s, t);
  at_.t_nu = place(assembly_.jacobian(), t, v);
  at_.t_mu = place(assembly_.jacobian(), t, u);
  at_.t_corner = place(level_.corner_pattern(), t, t, true);
  at_.t_turn = may_slide_in_space(assembly_) ? place(level_.corner_pattern(), t, s, true) : -1;
  at_.nu_fv_fz = place(full(n_, nz_), v, z);
  at_.nu_fv_Qz = nz_ > 0 ? place(full(n_, n_), v, u) : -1;
  finalize();
}

void SecondOrderAdjoint::require_plain_cost() const {
  if (objective_.running_needs_accelerations())
    throw CapabilityError(
        "The second-order adjoint needs derivatives of the accelerations where the running cost depends "
        "on accelerations or reactions; use the first-order adjoint of this formulation.");
}

void SecondOrderAdjoint::fill() {
  require_plain_cost();
  std::vector<double> second;
  const bool slides = calc_reaction_rates(assembly_, state(), reaction_rate_, second);
  // J' of rows that roll, or would if they did not slide.
  add_rolling_rates(assembly_, state(), reaction_rate_);
  if (slides) {
    level_.solve(level_.state());
    level_.linearize();
  }
  twist_ = rolling_twist(assembly_, state());
  slip_partials(assembly_, state(), slip_q_, slip_v_);
  corner_rate_ = slip_corner_rates(assembly_, state(), level_.corner_pattern());
  calc_path_rates(assembly_, state(), rates_);
  const Stabilization& st = level_.stabilization();
  D_.add_constant(at_.D_mu, 1);
  D_.add(at_.D_nu, assembly_.M.data());
  D_.add(at_.D_tau, assembly_.phi_q.data());
  D_.add_constant(at_.D_z, 1);
  A_.add_constant(at_.mu_nu, 1);
  A_.add(at_.nu_M1, rates_.M_dot.data(), -1);
  A_.add(at_.nu_C, assembly_.C.data());
  A_.add(at_.nu_mu, rates_.M_ddot.data(), -1);
  A_.add(at_.nu_mu_t, rates_.C_dot.data());
  A_.add(at_.nu_mu_t, assembly_.K.data(), -1);
  A_.add(at_.nu_tau, assembly_.phid_q.data());
  A_.add(at_.nu_tau, assembly_.phi_q.data(), st.by_rate());
  std::vector<double> held = assembly_.phi_q;
  for (std::size_t k = 0; k < held.size(); ++k)
    if (!assembly_.holds_position(static_cast<int>(assembly_.jacobian().row[k]))) held[k] = 0;
  A_.add(at_.nu_sigma, held.data(), -st.by_value());
  if (!twist_.empty()) A_.add(at_.nu_sigma, twist_.data(), st.by_rate());
  D_.add_constant(at_.D_sigma, 1);
  A_.add_constant(at_.sigma_tau, 1);
  A_.add(at_.t_nu, assembly_.reaction_jacobian().data());
  A_.add(at_.t_mu, reaction_rate_.data());
  A_.add(at_.t_corner, level_.corner());
  if (!corner_rate_.empty()) {
    D_.add(at_.nu_sigma, slip_v_.data(), -1);
    A_.add(at_.nu_sigma, slip_q_.data(), -1);
    A_.add(at_.t_turn, corner_rate_.data());
  }
  const ScalarGradient& g = running_gradient();
  ScalarGradient rate;
  rate.resize(assembly_);
  calc_running_gradient_rate(objective_, assembly_, state(), rate);
  b_.col(0).segment(n_, n_) = g.q - rate.v;
  b_.col(0).segment(2 * n_, nz_) = -g.z;
  if (nz_ == 0) return;
  A_.add(at_.z_mu, assembly_.Q_z.data(), -1);
  A_.add(at_.z_z, assembly_.f_z.data(), -1);
  A_.add(at_.nu_z, assembly_.f_q.data());
  A_.add(at_.nu_z, rates_.f_v_dot.data(), -1);
  // -f_v^T mu_z' = f_v^T (g_z + Q_z^T mu + f_z^T mu_z)
  const Eigen::MatrixXd f_v = to_dense(assembly_.state_force(), assembly_.f_v.data());
  const Eigen::MatrixXd fz = f_v.transpose() * to_dense(assembly_.state_state(), assembly_.f_z.data()).transpose();
  const Eigen::MatrixXd Qz = f_v.transpose() * to_dense(assembly_.force_state(), assembly_.Q_z.data()).transpose();
  A_.add(at_.nu_fv_fz, fz.data());
  A_.add(at_.nu_fv_Qz, Qz.data());
  b_.col(0).segment(n_, n_) += f_v.transpose() * g.z;
}

Eigen::VectorXd SecondOrderAdjoint::rest(const double* mu, const double* sigma, const double* mu_z) {
  Eigen::VectorXd r = -running_gradient().v;
  const SparsePattern& J = assembly_.jacobian();
  add_transposed_product(assembly_.square(), assembly_.C.data(), 1, mu, r.data());
  add_transposed_product(J, level_.R2_v().data(), 1, sigma, r.data());
  add_transposed_product(J, assembly_.phid_q.data(), -1, sigma, r.data());
  if (!twist_.empty()) add_transposed_product(J, twist_.data(), -1, sigma, r.data());
  add_product(assembly_.square(), rates_.M_dot.data(), -1, mu, r.data());
  if (nz_ > 0) add_transposed_product(assembly_.state_force(), assembly_.f_v.data(), -1, mu_z, r.data());
  return r;
}

void SecondOrderAdjoint::begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  require_plain_cost();
  Eigen::VectorXd wq, wv, wz;
  eliminate_terminal(wq, wv, wz, gradient);
  Eigen::VectorXd w(2 * n_ + nz_);
  w << wq, wv, wz;
  from_states(w, X, gradient);
}

void SecondOrderAdjoint::from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd&) {
  X = join({Y.col(0).head(n_), Y.col(0).segment(n_, n_), Y.col(0).tail(nz_)});
}

// KKT^T [mu; sigma] = [mu_v; 0], KKT^T [nu; tau] = [rest - mu_q; -J_r' mu - N'^T sigma]
Eigen::MatrixXd SecondOrderAdjoint::join(const StateAdjoint& mu) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n_ + m_), y = x;
  x.head(n_) = mu.v;
  level_.solve_kkt_transposed(x.data());
  y.head(n_) = rest(x.data(), x.data() + n_, mu.z.data()) - mu.q;
  add_product(assembly_.jacobian(), reaction_rate_.data(), -1, x.data(), y.data() + n_);
  if (!corner_rate_.empty())
    add_transposed_product(level_.corner_pattern(), corner_rate_.data(), -1, x.data() + n_, y.data() + n_);
  level_.solve_kkt_transposed(y.data());
  Eigen::MatrixXd X(size(), 1);
  X.col(0) << x.head(n_), y.head(n_), mu.z, x.tail(m_), y.tail(m_);
  return X;
}

// mu_v = M mu + Phi_q^T sigma, mu_q = rest - M nu - Phi_q^T tau
SecondOrderAdjoint::StateAdjoint SecondOrderAdjoint::split(const Eigen::MatrixXd& X) {
  const double *mu = X.data(), *nu = mu + n_, *mu_z = nu + n_, *sigma = mu_z + nz_, *tau = sigma + m_;
  StateAdjoint r{rest(mu, sigma, mu_z), Eigen::VectorXd::Zero(n_), X.col(0).segment(2 * n_, nz_)};
  level_.add_mass(1, mu, r.v.data());
  level_.add_jacobian_transposed(1, sigma, r.v.data());
  level_.add_mass(-1, nu, r.q.data());
  level_.add_jacobian_transposed(-1, tau, r.q.data());
  return r;
}

std::vector<double> SecondOrderAdjoint::plan(const std::vector<double>& times, const Motion& motion) {
  require_plain_cost();
  kinks_ = find_force_kinks(assembly_, objective_, times, motion, jumps());
  first_.resize(static_cast<std::size_t>(2 * n_ + nz_));
  motion(times.front(), first_.data());
  std::vector<double> changes;
  append_times(kinks_, changes);
  return changes;
}

bool SecondOrderAdjoint::before_step(double t, double, const double*, Eigen::MatrixXd& X, Eigen::VectorXd&) {
  const ForceKink* k = kink_before(kinks_, t);
  if (!k) return false;
  evaluate(k->after, k->state_after.data());
  const StateAdjoint mu = split(X);
  evaluate(k->before, k->state_before.data());
  X = join(mu);
  return true;
}

void SecondOrderAdjoint::integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) {
  // g_rho - mu^T F_rho - sigma^T R2_rho + mu_z^T f_rho
  out = running_gradient().rho;
  const double* mu_z = X.data() + 2 * n_;
  const auto w = level_.stabilization().weights(X.data(), mu_z + nz_, mu_z);
  go_to_slips();
  assembly_.add_parameter_gradient(state(), w, -1, out.data());
}

void SecondOrderAdjoint::finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  // Not at the start as it was solved for: at rest rounding decides on which side of a force's kink that is.
  evaluate(t_start, first_.data());
  const StateAdjoint mu = split(X);
  add_start_gradient(mu.q.data(), mu.v.data(), mu.z.data(), gradient);
}

Eigen::MatrixXd SecondOrderAdjoint::of_states(const Eigen::MatrixXd& X) {
  const StateAdjoint mu = split(X);
  Eigen::MatrixXd Y(2 * n_ + nz_, 1);
  Y << mu.q, mu.v, mu.z;
  return Y;
}

}  // namespace costate
