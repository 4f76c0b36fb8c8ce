#include "costate/adjoint/momentum_adjoint.h"

#include <Eigen/Dense>

#include "costate/adjoint/gradient_rate.h"
#include "costate/analysis/start.h"
#include "costate/assembly/slip_directions.h"
#include "costate/linear/to_dense.h"

namespace costate {

// Unknowns (mu_q, mu, mu_z, nu, kappa); rows (mu_q', P', mu_z', Phi_q mu, Phi_q mu_q).
MomentumAdjoint::MomentumAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                 Objective objective, Constraints constraints)
    : HandEquations(std::move(mechanism), std::move(parameters), std::move(objective), Stabilization{},
                    Direction::backward),
      constraints_(constraints) {
  const auto coordinates = assembly_.mechanism().coordinate_names();
  const auto rows = assembly_.mechanism().row_names();
  add_rows("mu_q.", coordinates, true);
  add_rows("mu.", coordinates, true);
  add_rows("mu_z.", assembly_.mechanism().state_names(), true);
  add_rows("nu.", rows, false);
  if (constraints == Constraints::index2) add_rows("kappa.", rows, false);
  const int q = 0, v = n_, z = 2 * n_, l = z + nz_, k = l + m_;
  const SparsePattern In = SparsePattern::identity(n_), Iz = SparsePattern::identity(nz_);
  at_.Dq = place(In, q, q);
  at_.DP = place(assembly_.square(), v, v);
  at_.Dz = place(Iz, z, z);
  at_.q_mu = place(assembly_.square(), q, v, true);
  at_.q_nu = place(assembly_.jacobian(), q, l, true);
  at_.q_z = place(assembly_.state_force(), q, z, true);
  at_.P_q = place(In, v, q);
  at_.P_mu = place(assembly_.square(), v, v, true);
  at_.P_z = place(assembly_.state_force(), v, z, true);
  at_.z_mu = place(assembly_.force_state(), z, v, true);
  at_.z_z = place(assembly_.state_state(), z, z, true);
  at_.phi_mu = place(assembly_.jacobian(), l, v);
  at_.corner = -1;
  if (constraints == Constraints::index2) {
    at_.q_kappa = place(assembly_.jacobian(), q, k, true);
    at_.P_kappa = place(assembly_.jacobian(), v, k, true);
    at_.phi_q = place(assembly_.jacobian(), k, q);
    if (assembly_.has_switched_rows()) {
      at_.corner = place(level_.corner_pattern(), l, k, true);
      at_.nu_corner = place(SparsePattern::identity(m_), k, l);
    }
  }
  finalize();
}

void MomentumAdjoint::fill() {
  D_.add_constant(at_.Dq, 1);
  D_.add(at_.DP, assembly_.M.data());
  D_.add_constant(at_.Dz, 1);
  A_.add(at_.q_mu, assembly_.K.data());
  A_.add(at_.q_nu, assembly_.phi_q.data());
  A_.add(at_.q_z, assembly_.f_q.data(), -1);
  A_.add_constant(at_.P_q, -1);
  A_.add(at_.P_mu, assembly_.C.data());
  A_.add(at_.P_z, assembly_.f_v.data(), -1);
  A_.add(at_.z_mu, assembly_.Q_z.data(), -1);
  A_.add(at_.z_z, assembly_.f_z.data(), -1);
  A_.add(at_.phi_mu, assembly_.reaction_jacobian().data());
  const ScalarGradient& g = running_gradient();
  b_.col(0).head(2 * n_ + nz_) << -g.q, -g.v, -g.z;
  b_.col(0).segment(2 * n_ + nz_, m_) = -g.lambda;
  d_.col(0).segment(n_, n_) = -g.a;
  if (constraints_ == Constraints::index2) {
    A_.add(at_.q_kappa, assembly_.phid_q.data());
    A_.add(at_.P_kappa, assembly_.phi_q.data());
    A_.add(at_.phi_q, assembly_.phi_q.data());
    if (at_.corner >= 0) switch_rows();
  }
}

// Of rows that are not there, or along which contacts slide, kappa is that of R2's corner; nu = 0 where no position is
// kept.
void MomentumAdjoint::switch_rows() {
  A_.add(at_.corner, level_.corner());
  std::vector<double> slip_q, slip_v;
  slip_partials(assembly_, state(), slip_q, slip_v);
  if (!slip_q.empty()) {
    A_.add(at_.q_kappa, slip_q.data());
    A_.add(at_.P_kappa, slip_v.data());
  }
  std::vector<double> lost = assembly_.phi_q, nu(static_cast<std::size_t>(m_));
  for (std::size_t k = 0; k < lost.size(); ++k)
    if (keeps_position(static_cast<int>(assembly_.jacobian().row[k]))) lost[k] = 0;
  A_.add(at_.q_nu, lost.data(), -1);
  A_.add(at_.phi_q, lost.data(), -1);
  for (int i = 0; i < m_; ++i) nu[static_cast<std::size_t>(i)] = level_.stabilizer_corner(i);
  A_.add(at_.nu_corner, nu.data());
}

void MomentumAdjoint::add_friction(Assembly::ParameterWeights& w) {
  go_to_slips();
  if (assembly_.sliding_rows().empty()) return;
  friction_.assign(static_cast<std::size_t>(m_), 0);
  for (const Assembly::SlidingRow& r : assembly_.sliding_rows())
    friction_[static_cast<std::size_t>(r.along)] = w.row_phid[r.along];
  w.row = friction_.data();  // of no other row
  w.c0 = w.c1 = 0;
  w.c2 = 1;
}

void MomentumAdjoint::begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  Eigen::VectorXd wq, wv, wz;
  eliminate_terminal(wq, wv, wz, gradient);
  Eigen::VectorXd w(2 * n_ + nz_);
  w << wq, wv, wz;
  from_states(w, X, gradient);
}

// P = M mu - g_a
Eigen::MatrixXd MomentumAdjoint::of_states(const Eigen::MatrixXd& X) {
  Eigen::MatrixXd Y = X.topRows(2 * n_ + nz_);
  Eigen::VectorXd P = -running_gradient().a;
  add_product(assembly_.square(), assembly_.M.data(), 1, X.data() + n_, P.data());
  Y.col(0).segment(n_, n_) = P;
  return Y;
}

// (1.3) to (1.5): of weights of all changes, the adjoint takes those that the constraints allow; the rest, with eta,
// goes to the parameters that move the constraints.
void MomentumAdjoint::from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  const Eigen::VectorXd wq = Y.col(0).head(n_), wv = Y.col(0).segment(n_, n_), wz = Y.col(0).tail(nz_);
  const ScalarGradient& g = running_gradient();
  const SparsePattern& J = assembly_.jacobian();
  Eigen::VectorXd kkt(n_ + m_);
  kkt << wv + g.a, g.lambda;
  level_.solve_kkt_transposed(kkt.data());
  const Eigen::VectorXd mu = kkt.head(n_), eta_v = kkt.tail(m_);
  Eigen::VectorXd eta_q(m_), mu_q = wq;
  add_transposed_product(J, assembly_.phid_q.data(), -1, eta_v.data(), mu_q.data());
  if (constraints_ == Constraints::index2) {
    // Least squares: redundant rows do no harm.
    Eigen::MatrixXd dense = to_dense(J, assembly_.phi_q.data());
    for (int i = 0; i < m_; ++i)
      if (!keeps_position(i)) dense.row(i).setZero();
    if (m_ > 0) eta_q = dense.transpose().completeOrthogonalDecomposition().solve(mu_q);
  } else {
    kkt.head(n_) = -g.v - mu_q;
    kkt.tail(m_).setZero();
    if (objective_.running_needs_accelerations()) {
      ScalarGradient rate;
      rate.resize(assembly_);
      calc_running_gradient_rate(objective_, assembly_, level_, rate);
      kkt.head(n_) += rate.a;
      kkt.tail(m_) += rate.lambda;
    }
    Eigen::VectorXd M_dot_mu = Eigen::VectorXd::Zero(n_);
    assembly_.add_mass_rate_product(state(), mu.data(), M_dot_mu.data());
    kkt.head(n_) -= M_dot_mu;
    add_transposed_product(assembly_.square(), assembly_.C.data(), 1, mu.data(), kkt.data());
    if (nz_ > 0) add_transposed_product(assembly_.state_force(), assembly_.f_v.data(), -1, wz.data(), kkt.data());
    add_product(J, assembly_.phid_q.data(), -1, mu.data(), kkt.data() + n_);
    level_.solve_kkt(kkt.data());
    eta_q = -kkt.tail(m_);
  }
  add_transposed_product(J, assembly_.phi_q.data(), -1, eta_q.data(), mu_q.data());
  X.setZero(size(), 1);
  X.col(0).head(2 * n_ + nz_) << mu_q, mu, wz;
  Assembly::ParameterWeights w;
  w.row_phi = eta_q.data();
  w.row_phid = eta_v.data();  // friction moves no constraint
  assembly_.add_parameter_gradient(state(), w, -1, gradient.data());
}

void MomentumAdjoint::integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) {
  out = running_gradient().rho;
  Assembly::ParameterWeights w;
  w.force = X.data() + n_;
  w.state = X.data() + 2 * n_;
  w.row_phi = w.state + nz_;
  if (constraints_ == Constraints::index2) {
    w.row_phid = w.row_phi + m_;
    add_friction(w);
  }
  assembly_.add_parameter_gradient(state(), w, -1, out.data());
}

void MomentumAdjoint::finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  const Start& s = start();
  // At t_start: P = M mu - g_a.
  Eigen::VectorXd y(2 * n_ + nz_);
  y << s.q, s.v, s.z;
  evaluate(t_start, y.data());
  Eigen::VectorXd P = -running_gradient().a;
  add_product(assembly_.square(), assembly_.M.data(), 1, X.data() + n_, P.data());
  add_start_gradient(X.data(), P.data(), X.data() + 2 * n_, gradient);
}

}  // namespace costate
