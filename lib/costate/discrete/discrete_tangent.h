// The exact derivative of a discrete run with respect to all parameters, step by step beside it (the numbers 1 to 4 are
// those of discrete_scheme.h; a dot is the derivative with respect to one parameter, one column each):
//   1  J (a*, f*, lambda*). = -(K q_g. + C v_g. - Q_z z_g. + F_rho,  -(f_q q_g. + f_v v_g. + f_z z_g. + f_rho),
//                               (Phi_q q_g. + Phi_rho) / B)                              blocks at the stage
//   2  P (u, eta).          = -(V_q q. + V_rho,  Phid_q q. + Phid_rho + Phi_q v*.)       V = M u + Phi_q^T eta, u fixed
//   3  P (a, lambda).       = -(K q. + C v. - Q_z z. + F_rho,  Phidd_q q. + 2 Phid_q v. + Phidd_rho)   at the end state
// with the factors that the step itself has made.
#pragma once

#include <functional>

#include "costate/discrete/step_length.h"

namespace costate {

class DiscreteTangent {
 public:
  explicit DiscreteTangent(DiscreteScheme& scheme);

  /// After scheme.start(..., StartDerivative::columns).
  void start();
  /// After each scheme.step().
  void step();

  // Across a jump; dt has one entry a parameter.
  /// What a step hands on is by `column` dt further.
  void add(const StepColumn& column, const Eigen::RowVectorXd& dt);
  /// Visits the columns (q, v, z), one a parameter and one behind the other, which may change.
  void change(const std::function<void(double* const* columns, int count)>& visit);
  /// After the scheme has begun anew, in time by dt later; the derivatives of multipliers are still those before, on
  /// which the direction of what begins to slide from rest depends.
  void begin_anew(const Eigen::RowVectorXd& dt);
  /// w^T of the present derivatives and of the parameters.
  Eigen::RowVectorXd along(const ScalarGradient& w) const;

  /// gradient += weight d(g)/d(rho) at the present state, for the running cost or the terminal one.
  void add_running_cost(double weight, double* gradient) { add_cost(weight, gradient, false); }
  void add_terminal_cost(double* gradient) { add_cost(1, gradient, true); }

  // Derivatives of the present state: n x np, ..., m x np.
  const Eigen::MatrixXd& q() const { return q_; }
  const Eigen::MatrixXd& v() const { return v_; }
  const Eigen::MatrixXd& z() const { return z_; }
  const Eigen::MatrixXd& a() const { return a_; }
  const Eigen::MatrixXd& lambda() const { return lambda_; }

 private:
  void add_cost(double weight, double* gradient, bool terminal);
  void stage();
  void project_velocities();
  void find_accelerations(const Eigen::RowVectorXd* dt = nullptr);

  DiscreteScheme& scheme_;
  Assembly& assembly_;
  int n_, m_, nz_, np_;
  Eigen::MatrixXd q_, v_, z_, a_, lambda_, f_, alpha_, y_;
  Eigen::MatrixXd right_;  // n + nz + m rows
  Eigen::MatrixXd turns_;  // of slips in space, in the step that ends here
  std::vector<double> hessian_;
  TimePartials time_;
  Assembly::ParameterColumns columns_;
  ScalarGradient cost_;
};

}  // namespace costate
