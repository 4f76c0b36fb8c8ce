// The direct differentiation (tangent) systems, for Sq = dq/drho, Sv, Sz, Sa, Sl, one column a parameter:
//   Sq' = Sv (- Phi_q^T Sg), Sv' = Sa, Sz' = f_q Sq + f_v Sv + f_z Sz + f_rho,
//   0 = M Sa + C Sv + K Sq - Q_z Sz + Phi_q^T Sl + F_rho,
// closed by the linearised constraints of the formulation:
//   acceleration level: 0 = Phi_q Sa + R2_v Sv + R2_q Sq - Sl/alpha + R2_rho
//   stabilised index 2: 0 = Phi_q Sv + Phid_q Sq + Phid_rho and 0 = Phi_q Sq + Phi_rho (with Sg)
//   index 3:            0 = Phi_q Sq + Phi_rho
#pragma once

#include "costate/adjoint/hand_equations.h"

namespace costate {

class TangentEquations final : public HandEquations {
 public:
  enum class Constraints { acceleration, index2, index3 };
  TangentEquations(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
                   Stabilization stabilization, Constraints constraints);
  /// Index 3: Sv goes with 1/h, Sa and Sl with 1/h^2 of Sq.
  int step_power(int row) const override {
    if (constraints_ != Constraints::index3 || row < n_ || row >= 3 * n_ + nz_) return 0;
    return row < 2 * n_ ? 1 : row < 2 * n_ + nz_ ? 0 : 2;
  }
  void begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  void integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) override;
  void finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;

  bool carries_switched_rows() const override { return constraints_ != Constraints::index3; }

 protected:
  void fill() override;
  Eigen::MatrixXd of_states(const Eigen::MatrixXd& X) override;
  void from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  bool integrand_needs_blocks() const override {
    return constraints_ != Constraints::acceleration && objective_.running_needs_accelerations();
  }

 private:
  /// The parts of X; a and lambda, where they are needed, from the KKT system, which holds whatever the constraints'
  /// level.
  void split(const Eigen::MatrixXd& X, bool with_accelerations);
  void switch_rows(const Assembly::ParameterColumns& c);
  Constraints constraints_;
  Eigen::MatrixXd Sq_, Sv_, Sz_, Sa_, Sl_;
  struct Blocks {
    int Dq, Dv, Dz, q_v, q_g, v_a, z_q, z_v, z_z, K, C, Q_z, M, phi_t, r_q, r_v, r_a, corner, p_q, gamma_corner;
  } at_{};
};

}  // namespace costate
