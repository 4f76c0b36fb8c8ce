// The adjoint equations of Maggi's formulations in independent coordinates, lib/README.md (5.5) to (5.12). All
// of them stand for the adjoints mu_y, mu_yd, mu_f of the states (y, yd, z) and differ in what they
// integrate. With mu the adjoint of the equations of motion and g_y, g_yd, g_ydd the cost's gradient in
// independent variables:
//   My mu = mu_yd + g_ydd
//   mu_y'  = -g_y + Ky^T mu - Zq^T mu_f
//   mu_yd' = -g_yd - mu_y + Cy^T mu - Zv^T mu_f
//   mu_f'  = -g_z - Qz^T mu - f_z^T mu_f
//   psi_rho = w_rho + integral of g_rho - Fy^T mu + Zr^T mu_f dt
//             + y_rho^T mu_y + yd_rho^T mu_yd + z_rho^T mu_f at the start
// Another choice of coordinates, going back in time from B2 to B1 (5.12):
//   mu_y1 = (B2 R1)^T mu_y2 + (B2 D1)^T mu_yd2,   mu_yd1 = (B2 R1)^T mu_yd2,
//   psi_rho gains (B2 Nr1)^T mu_y2 + (B2 Vr1)^T mu_yd2.
#pragma once

#include "costate/adjoint/maggi_equations.h"

namespace costate {

class MaggiAdjoint : public MaggiEquations {
 public:
  MaggiAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective);
  void begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  void integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) override;
  void finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;

 protected:
  struct Adjoint {
    Eigen::VectorXd y, yd, f;
  };
  /// X at the evaluated point from the states' adjoints, and back.
  virtual Eigen::VectorXd join(const Adjoint& mu) = 0;
  virtual Adjoint split(const Eigen::VectorXd& X) = 0;
  /// Where X is split last.
  virtual void evaluate_finish() { evaluate_start(); }
  /// mu, the adjoint of the equations of motion.
  virtual Eigen::VectorXd multiplier(const Eigen::VectorXd& X) = 0;
  /// That of the force states, which every form keeps behind its first two unknowns.
  Eigen::VectorXd force_states(const Eigen::VectorXd& X) const { return X.segment(2 * f_, nz_); }
  /// The running cost's gradient at the evaluated point, without that of parameters.
  MaggiBlocks::Reduced running() { return at_.reduce(running_gradient(), false); }
  void change_chart(int to, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  Eigen::MatrixXd of_states(const Eigen::MatrixXd& X) override;
  void from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;

 private:
  Eigen::VectorXd of_places_;  // what the gradient gains by the places that of_states() expressed
};

/// Explicit form of first order: X = (mu_y, mu_yd, mu_f), mu solved for.
class MaggiExplicitAdjoint final : public MaggiAdjoint {
 public:
  MaggiExplicitAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective);

 protected:
  void fill() override;
  Eigen::VectorXd join(const Adjoint& mu) override;
  Adjoint split(const Eigen::VectorXd& X) override;
  Eigen::VectorXd multiplier(const Eigen::VectorXd& X) override;

 private:
  struct Blocks {
    int Dy, Dyd, Df, y_yd, y_f, yd_y, yd_yd, yd_f, f_yd, f_f;
  } block_{};
};

/// Implicit form of first order (5.7): X = (mu_y, mu, mu_f), with the momentum P = My mu - g_ydd (= mu_yd)
/// carried as it is, so that neither My is inverted nor its rate needed:
///   P' = (My mu - g_ydd)' = -g_yd - mu_y + Cy^T mu - Zv^T mu_f.
class MaggiImplicitAdjoint final : public MaggiAdjoint {
 public:
  MaggiImplicitAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective);

 protected:
  void fill() override;
  Eigen::VectorXd join(const Adjoint& mu) override;
  Adjoint split(const Eigen::VectorXd& X) override;
  Eigen::VectorXd multiplier(const Eigen::VectorXd& X) override;

 private:
  struct Blocks {
    int Dy, DP, Df, y_mu, y_f, P_y, P_mu, P_f, f_mu, f_f;
  } block_{};
};

}  // namespace costate
