// The first-order adjoint of the acceleration-level formulations (index-1, Baumgarte, penalty, augmented Lagrangian):
//   mu_q' = -g_q^T + K^T s1 + R2_q^T s2 - f_q^T mu_z
//   mu_v' = -g_v^T - mu_q + C^T s1 + R2_v^T s2 - f_v^T mu_z
//   mu_z' = -g_z^T - Q_z^T s1 - f_z^T mu_z
//   [[M, Phi_q^T], [Phi_q, -1/alpha]] [s1; s2] = [mu_v + g_a^T; g_l^T]     its transpose where contacts slide (19.6)
// with mu(T) = w^ (accelerations and multipliers eliminated) and the gradient
//   w^_rho + int (g_rho - s1^T F_rho - s2^T R2_rho + mu_z^T f_rho) dt + mu(0)^T S(0).
#pragma once

#include "costate/adjoint/hand_equations.h"

namespace costate {

class AccelerationAdjoint final : public HandEquations {
 public:
  AccelerationAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
                      Stabilization stabilization);
  void begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  void integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) override;
  void finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  bool carries_switched_rows() const override { return true; }

 protected:
  void fill() override;
  Eigen::MatrixXd of_states(const Eigen::MatrixXd& X) override;
  void from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  bool integrand_needs_blocks() const override { return false; }

 private:
  struct Blocks {
    int Dq, Dv, Dz, q_s1, q_s2, q_z, v_q, v_s1, v_s2, v_z, z_s1, z_z, s_M, s_phi_t, s_v, s_phi, corner;
  } at_{};
};

}  // namespace costate
