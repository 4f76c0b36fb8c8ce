// The transpose of the discrete tangent, from the last step to the start: one solve with J^T and two with P a step,
// whatever the number of parameters. Bars are derivatives of psi with respect to what stands below them (the numbers
// are those of discrete_scheme.h, in reverse):
//   4  a~ += new_a alpha~, f~ += new_f y~ and shares for the last state's a, alpha, f, y
//   3  s = P^-1 (a~, f~, lambda~):  q~ -= K^T s1 + Phidd_q^T s2 - f_q^T sz,  v~ -= C^T s1 + 2 Phid_q^T s2 - f_v^T sz,
//      z~ += Q_z^T s1 + f_z^T sz,   rho~ -= F_rho^T s1 + Phidd_rho^T s2 - f_rho^T sz
//   2  s = P^-1 (v~, 0, 0):         q~ -= V_q^T s1 + Phid_q^T s2,  v*~ = v~ - Phi_q^T s2,  rho~ -= V_rho^T s1 +
//   Phid_rho^T s2 1  s = J^-T (B q~ + G v*~, G_z z~, 0):  q_g~ = q~ - K^T s1 + f_q^T sz - Phi_q^T s2 / B,
//      v_g~ = v*~ - C^T s1 + f_v^T sz,  z_g~ = z~ + Q_z^T s1 + f_z^T sz,
//      rho~ -= F_rho^T s1 - f_rho^T sz + Phi_rho^T s2 / B           and from these the last state's bars
#pragma once

#include <functional>

#include "costate/discrete/step_length.h"

namespace costate {

class DiscreteAdjoint {
 public:
  explicit DiscreteAdjoint(DiscreteScheme& scheme);

  /// Forgets everything: no bars, no gradient.
  void clear();
  /// Adds the derivatives of the cost at the scheme's present record.
  void add_running_cost(double weight) { add_cost(weight, false); }
  void add_terminal_cost() { add_cost(1, true); }

  /// Goes back over the scheme's present step. With `factored`, its matrices are those of that step; otherwise they are
  /// factored again.
  void step_back(bool factored);
  // Back across a jump, at the record behind it and then at that before it; none is factored.
  /// Of a state at which the scheme has begun anew: the bars of (q, v, z) alone remain, and those of the multipliers
  /// before it, on which the direction of what begins to slide from rest depends. Returns that of time.
  double begin_anew_back();
  /// Visits the bars of (q, v, z), one behind the other, which may change, and the gradient; returns what it does.
  double change(const std::function<double(double* bars, double* gradient)>& visit);
  /// The bars along a derivative of what the step hands on.
  double along(const StepColumn& column) const;
  /// Adds c w to the bars and to the gradient.
  void add(double c, const ScalarGradient& w);
  /// gradient[j] += c by[j].
  void add_parameters(double c, const std::vector<double>& by);
  /// Of an instant in the place of a step nothing but (q, v, z) is handed on.
  void forget_rates();

  /// At record 0: closes with the start's own derivative and returns the gradient.
  const std::vector<double>& finish(bool factored);

 private:
  void add_cost(double weight, bool terminal);
  void accelerations_back();
  void accelerations_anew_back(const StateView& s, double* friction_before);
  void velocities_back();
  void stage_back(bool factored);
  void add_end_parameters(const double* velocity_rows);
  /// outer_ += s1 a^T.
  void add_outer(const double* s1, const double* a);
  /// The transposed rows of forces and force states at the evaluated point: bars -= [K C -Q_z; -f_q -f_v -f_z]^T s.
  void subtract_rows(const Eigen::VectorXd& s);

  DiscreteScheme& scheme_;
  Assembly& assembly_;
  int n_, m_, nz_;
  Eigen::VectorXd q_, v_, z_, a_, lambda_, f_, alpha_, y_;  // bars
  Eigen::VectorXd s_, w_;                                   // n + nz + m: solutions of 3 and 1, of 2
  TimePartials time_;
  Eigen::VectorXd sigma_;  // of slips in space
  std::vector<double> hessian_, gradient_;
  // Sums over all steps for bodies of constant mass and force: the parameters in these cost nothing a step.
  std::vector<double> outer_;  // on the square pattern
  Eigen::VectorXd sum_;        // n
  ScalarGradient cost_;
};

}  // namespace costate
