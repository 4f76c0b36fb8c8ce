// The adjoint of Maggi's formulations in second-order form, lib/README.md (5.8), (5.11): X = (mu, mu', mu_f), and
//   Mz mu'' + (2 Mz' - Cz^T) mu' + (Mz'' - Cz'^T + Kz^T) mu = g_z - (g_zd)' + Zq^T mu_f - (Zv^T mu_f)'
// carried as (Mz mu')' = Mz mu'' + Mz' mu'. The rates, with R' = D, R'' = A and those of M, C, f_v from
// kernels evaluated along the motion (assembly/path_rates.h), are
//   Mz'  = R^T M' R + D^T M R + R^T M D
//   Mz'' = R^T M'' R + 2 (D^T M' R + R^T M' D + D^T M D) + A^T M R + R^T M A
//   Cz'  = D^T (C R + 2 M D) + R^T (C' R + C D + 2 M' D + 2 M A)
//   Zv'  = f_v' R + f_v D,   (g_zd)' = D^T g_v + R^T (g_v)'
// Running costs on accelerations or reactions would need third and fourth derivatives of the motion and are
// refused.
#pragma once

#include "costate/adjoint/force_kinks.h"
#include "costate/adjoint/maggi_adjoint.h"
#include "costate/assembly/path_rates.h"

namespace costate {

class MaggiSecondOrderAdjoint final : public MaggiAdjoint {
 public:
  MaggiSecondOrderAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                          Objective objective);

  /// Kinks of forces, where the blocks whose rates stand above jump, and mu' with them; mu_z and mu_zd do not.
  std::vector<double> plan(const std::vector<double>& times, const Motion& motion) override;
  bool before_step(double t, double next, const double* qvz, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;

 protected:
  void fill() override;
  Eigen::VectorXd join(const Adjoint& mu) override;
  Adjoint split(const Eigen::VectorXd& X) override;
  Eigen::VectorXd multiplier(const Eigen::VectorXd& X) override { return X.head(f_); }

 private:
  /// -g_zd + Cz^T mu - Zv^T mu_f - Mz' mu, which is mu_z + Mz mu'.
  Eigen::VectorXd rest(const Eigen::VectorXd& mu, const Eigen::VectorXd& mu_f);

  void require_plain_cost() const;

  PathRates rates_;
  std::vector<ForceKink> kinks_;
  Eigen::MatrixXd Mz_dot_;
  struct Blocks {
    int D_mu, D_nu, D_f, mu_nu, nu_nu, nu_mu, nu_f, f_mu, f_f;
  } block_{};
};

}  // namespace costate
