// The tangent equations (direct differentiation) of Maggi's formulations, lib/README.md (5.10): with dy = Sy,
// ...
//   Sy' = Syd,   My Sydd + Cy Syd + Ky Sy - Qz Sz = -Fy,   Sz' = Zv Syd + Zq Sy + f_z Sz + Zr.
// The explicit form integrates (Sy, Syd, Sz), with Syd' = Sydd solved for; the implicit one keeps Sydd as an
// unknown of the algebraic row. Where the independent coordinates change: Sy = B2 dq, Syd = B2 dv (5.6).
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
  /// X from dq, dv and dz, in the chart of the evaluated point.
  Eigen::MatrixXd project(const Eigen::MatrixXd& dq, const Eigen::MatrixXd& dv, const Eigen::MatrixXd& dz);
  /// Sydd of the equations of motion.
  Eigen::MatrixXd accelerations(const Eigen::MatrixXd& X);
  void add_null_terms(const ScalarGradient& g, Eigen::VectorXd& out);

  Form form_;
  Eigen::MatrixXd dq_, dv_, da_, dlambda_, dz_;
  struct Blocks {
    int Dy, Dyd, Dz, y_yd, yd_y, yd_yd, yd_z, yd_w, z_y, z_yd, z_z, w_y, w_yd, w_z, w_w;
  } block_{};
};

}  // namespace costate
