// The adjoint of Maggi's formulations in second-order form, lib/README.md (5.8), (5.11): X = (mu, mu', mu_f), and
//   My mu'' + (2 My' - Cy^T) mu' + (My'' - Cy'^T + Ky^T) mu = g_y - (g_yd)' + Zq^T mu_f - (Zv^T mu_f)'
// carried as (My mu')' = My mu'' + My' mu'. The rates, with R' = D, R'' = A and those of M, C, f_v from
// kernels evaluated along the motion (assembly/path_rates.h), are
//   My'  = R^T M' R + D^T M R + R^T M D
//   My'' = R^T M'' R + 2 (D^T M' R + R^T M' D + D^T M D) + A^T M R + R^T M A
//   Cy'  = D^T (C R + 2 M D) + R^T (C' R + C D + 2 M' D + 2 M A)
//   Zv'  = f_v' R + f_v D,   (g_yd)' = D^T g_v + R^T (g_v)'
// Where contacts slide in the plane (5.14) R_r^T, R_r'^T and R_r''^T stand in front of M and C, and all these matrices
// are transposed in the equation, which is that of symmetric ones above. Of places mu' is -mu_y, as nothing moves
// there. Running costs on accelerations or reactions would need third and fourth derivatives of the motion and are
// refused. So would Cy' where a contact slides in space, as C holds the normal force there: X = (mu, mu_y, mu_f), and
//   My^T mu' = -g_yd + Cy^T mu - Zv^T mu_f - My'^T mu - mu_y,   mu_y' = -g_y + Ky^T mu - Zq^T mu_f.
#pragma once

#include "costate/adjoint/force_kinks.h"
#include "costate/adjoint/maggi_adjoint.h"
#include "costate/assembly/path_rates.h"
#include "costate/assembly/slip_directions.h"

namespace costate {

class MaggiSecondOrderAdjoint final : public MaggiAdjoint {
 public:
  MaggiSecondOrderAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                          Objective objective);

  /// Kinks of forces, where the blocks whose rates stand above jump, and mu' with them; mu_y and mu_yd do not.
  std::vector<double> plan(const std::vector<double>& times, const Motion& motion) override;
  bool before_step(double t, double next, const double* qvz, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  bool carries_switched_rows() const override { return true; }

 protected:
  void fill() override;
  Eigen::VectorXd join(const Adjoint& mu) override;
  Adjoint split(const Eigen::VectorXd& X) override;
  /// At the motion's own state: at rest rounding decides on which side of a force's kink a start is.
  void evaluate_finish() override { evaluate(t_start, first_.data()); }
  Eigen::VectorXd multiplier(const Eigen::VectorXd& X) override { return X.head(f_); }

 private:
  /// -g_yd + Cy^T mu - Zv^T mu_f - My' mu, which is mu_y + My mu'.
  Eigen::VectorXd rest(const Eigen::VectorXd& mu, const Eigen::VectorXd& mu_f);
  void fill_slip_in_space();

  void require_plain_cost() const;

  PathRates rates_;
  std::vector<ForceKink> kinks_;
  std::vector<double> first_;  // (q, v, z) where the motion begins
  Eigen::MatrixXd My_dot_;
  struct Blocks {
    int D_mu, D_nu, D_f, mu_nu, nu_nu, nu_mu, nu_f, f_mu, f_f, mu_mu, mu_y, mu_f;
  } block_{};
};

}  // namespace costate
