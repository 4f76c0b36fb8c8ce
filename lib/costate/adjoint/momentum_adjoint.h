// The first-order adjoints of index 3 and of its stabilised index-2 form, with P := M mu - g_a^T:
//   mu_q' = -g_q^T + K^T mu + Phi_q^T nu (+ Phid_q^T kappa) - f_q^T mu_z
//   P'    = -g_v^T - mu_q + C^T mu (+ Phi_q^T kappa) - f_v^T mu_z
//   mu_z' = -g_z^T - Q_z^T mu - f_z^T mu_z
//   0 = Phi_q mu - g_l^T   (index 2: and 0 = Phi_q mu_q)
// Boundary multipliers at T (index 3 needs time derivatives of the cost's partials, index 2 none):
//   (i)   KKT [mu; eta_v] = [w^_v + g_a; g_l]
//   (ii)  index 3: KKT [mu'; -eta_q] = [-g_v - w^_q + Phid_q^T eta_v + C^T mu + (g_a)' - M' mu; (g_l)' - Phid_q mu]
//         index 2: Phi_q Phi_q^T eta_q = Phi_q (w^_q - Phid_q^T eta_v)
//   (iii) P(T) = w^_v - Phi_q^T eta_v, mu_q(T) = w^_q - Phi_q^T eta_q - Phid_q^T eta_v
// Gradient: w^_rho - eta_q^T Phi_rho - eta_v^T Phid_rho + int (g_rho - mu^T F_rho - nu^T Phi_rho - kappa^T Phid_rho
// + mu_z^T f_rho) dt + mu_q(0)^T Sq0 + P(0)^T Sv0 + mu_z(0)^T Sz0.
#pragma once

#include "costate/adjoint/hand_equations.h"

namespace costate {

class MomentumAdjoint final : public HandEquations {
 public:
  enum class Constraints { index2, index3 };
  MomentumAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
                  Constraints constraints);
  void begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  void integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) override;
  void finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  bool carries_switched_rows() const override { return constraints_ == Constraints::index2; }

 protected:
  void fill() override;
  Eigen::MatrixXd of_states(const Eigen::MatrixXd& X) override;
  void from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  bool integrand_needs_blocks() const override { return false; }

 private:
  void switch_rows();
  bool keeps_position(int row) const { return assembly_.is_there(row) && assembly_.holds_position(row); }
  /// What friction coefficients do where contacts slide, with the weights of Phid.
  void add_friction(Assembly::ParameterWeights& w);
  Constraints constraints_;
  struct Blocks {
    int Dq, DP, Dz, q_mu, q_nu, q_kappa, q_z, P_q, P_mu, P_kappa, P_z, z_mu, z_z, phi_mu, phi_q, corner, nu_corner;
  } at_{};
  std::vector<double> friction_;
};

}  // namespace costate
