// The tangent equations (direct differentiation) of Maggi's formulations, lib/README.md (5.10): with dz = Sz,
// ...
//   Sz' = Szd,   Mz Szdd + Cz Szd + Kz Sz - Qz Szf = -Fz,   Szf' = Zv Szd + Zq Sz + f_z Szf + Zr.
// The explicit form integrates (Sz, Szd, Szf), with Szd' = Szdd solved for; the implicit one keeps Szdd as an
// unknown of the algebraic row. Where the independent coordinates change: Sz = B2 dq, Szd = B2 dv (5.6).
#pragma once

#include "costate/adjoint/maggi_equations.h"

namespace costate {

class MaggiTangent final : public MaggiEquations {
 public:
  enum class Form { explicit_form, implicit_form };
  MaggiTangent(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
               Form form);
  void begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  void integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) override;
  void finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;

 protected:
  void fill() override;
  Eigen::MatrixXd of_states(const Eigen::MatrixXd& X) override;
  void from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;
  void change_chart(int to, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) override;

 private:
  /// dq, dv, da, dlambda of X at the evaluated point.
  void expand(const Eigen::MatrixXd& X);
  /// X from dq, dv and dzf, in the chart of the evaluated point.
  Eigen::MatrixXd project(const Eigen::MatrixXd& dq, const Eigen::MatrixXd& dv, const Eigen::MatrixXd& dzf);
  /// Szdd of the equations of motion.
  Eigen::MatrixXd accelerations(const Eigen::MatrixXd& X);
  void add_null_terms(const ScalarGradient& g, Eigen::VectorXd& out);

  Form form_;
  Eigen::MatrixXd dq_, dv_, da_, dlambda_, dzf_;
  struct Blocks {
    int Dz, Dzd, Dzf, z_zd, zd_z, zd_zd, zd_zf, zd_w, zf_z, zf_zd, zf_zf, w_z, w_zd, w_zf, w_w;
  } block_{};
};

}  // namespace costate
