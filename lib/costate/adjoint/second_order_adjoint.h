// The second-order adjoint of the acceleration-level formulations: mu and nu = mu' are integrated themselves, with
// sigma = alpha Phi_q mu and tau = sigma' beside them:
//   mu' = nu
//   (M nu + Phi_q^T tau)' = -(M' - C^T) nu - (M'' - C'^T + K^T) mu + (Phid_q + 2 xi omega Phi_q)^T tau
//                           - omega^2 Phi_q^T sigma + g_q^T - (g_v^T)' + f_q^T mu_z - (f_v^T mu_z)'
//   mu_z' = -g_z^T - Q_z^T mu - f_z^T mu_z
//   sigma' = tau,   0 = Phi_q nu + Phid_q mu - tau / alpha
// The last two keep what begin() starts with, Phi_q mu = sigma / alpha. As a row of its own that would make sigma alpha
// times the integration's error.
// This is Mb mu'' + (2 Mb' - Cb^T) mu' + (Mb'' - Cb'^T + Kb^T) mu = g_q^T - (g_v^T)' of the penalty formulation with
// Mb = M + Phi_q^T alpha Phi_q, Cb = C + Phi_q^T alpha R2_v, Kb = K + Phi_q^T alpha R2_q, written with sigma and tau so
// that alpha multiplies nothing: in Mb'' and its neighbours the terms with Phidd_q cancel analytically, which in the
// compact form costs log10(alpha) digits of the trajectory's accuracy (measured: 5e-3 instead of 2e-7 at rtol 1e-8,
// alpha 1e6). 1/alpha = 0 gives the second-order adjoint of index-1 and Baumgarte.
// Where contacts close (lib/README.md (19)) -1/alpha of a row that is not there is -1 and sigma = 0, and what keeps
// rates alone has no omega^2. Where they slide in the plane the matrix is not symmetric: with the rows J_r of reactions
// and the corner N of R2, of which -s mu is an entry,
//   M mu + Phi_q^T sigma = mu_v,   J_r mu + N^T sigma = 0,   sigma' = tau,
//   J_r nu + J_r' mu + N^T tau + N'^T sigma = 0.
// In space N turns with the slip, and R2 of its rows has derivatives E_q, E_v of its own (assembly/slip_directions.h):
// the second equation is one of (M nu + Phi_q^T tau - E_v^T sigma)', with -E_q^T sigma on the right. Of rows J(q) v
// that roll W = J' - (J v)_q is not zero: the rate of J is Phid_q + W, and the second equation gains 2 xi omega W^T
// sigma. M', M'', C', f_v' come from kernels on path duals. Running costs on accelerations or reactions would need
// third and fourth derivatives of the motion and are refused.
#pragma once

#include "costate/adjoint/force_kinks.h"
#include "costate/adjoint/hand_equations.h"
#include "costate/assembly/path_rates.h"

namespace costate {

class SecondOrderAdjoint final : public HandEquations {
 public:
  SecondOrderAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
                     Stabilization stabilization);
  bool carries_switched_rows() const override { return true; }
  /// Kinks of forces, where the blocks whose rates stand above jump, and nu and tau with them; mu_q and mu_v do not.
  std::vector<double> plan(const std::vector<double>& times, const Motion& motion) override;
  bool before_step(double t, double next, const double* qvz, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  void begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  void integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) override;
  void finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;

 protected:
  void fill() override;
  Eigen::MatrixXd of_states(const Eigen::MatrixXd& X) override;
  void from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  bool integrand_needs_blocks() const override { return false; }

 private:
  struct StateAdjoint {
    Eigen::VectorXd q, v, z;
  };
  /// X at the evaluated point from the states' adjoints, and back.
  Eigen::MatrixXd join(const StateAdjoint& mu);
  StateAdjoint split(const Eigen::MatrixXd& X);
  /// -g_v + C^T mu + R2_v^T sigma - f_v^T mu_z - M' mu - Phid_q^T sigma: what is left of mu_q when (M nu + Phi_q^T tau)
  /// is taken away, with the sign of the equation mu_q = rest - (M nu + Phi_q^T tau).
  Eigen::VectorXd rest(const double* mu, const double* sigma, const double* mu_z);
  void require_plain_cost() const;

  std::vector<double> reaction_rate_;    // J_r', on the Jacobian's pattern
  std::vector<double> twist_;            // W, likewise, where something rolls, or empty
  std::vector<double> slip_q_, slip_v_;  // E_q and E_v, likewise, of what slides in space, or empty
  std::vector<double> corner_rate_;      // N' on the corner's pattern, or empty
  PathRates rates_;
  std::vector<ForceKink> kinks_;
  std::vector<double> first_;  // (q, v, z) where the motion begins
  struct Blocks {
    int D_mu, D_nu, D_tau, D_z, mu_nu, nu_M1, nu_C, nu_mu, nu_mu_t, nu_tau, nu_sigma, nu_z, z_mu, z_z, D_sigma,
        sigma_tau, t_nu, t_mu, t_corner, t_turn, nu_fv_fz, nu_fv_Qz;
  } at_{};
};

}  // namespace costate
