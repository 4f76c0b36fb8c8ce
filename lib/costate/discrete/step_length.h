// How a discrete step changes with its own length, at the same beginning: with the numbers 1 to 4 of discrete_scheme.h,
// a prime for the derivative by h, and tau = t_end', which is 1 where the step's end moves in time with its length and
// 0 where the end stays and the beginning moves:
//   q_e = v0 + 2 (q_alpha alpha0 + q_a a0 + B a*)/h,  v_e = (v_alpha alpha0 + v_a a0 + G a*)/h,  z_e likewise
//   1  J (a*, f*, lambda*)' = -(K q_e + C v_e - Q_z z_e + tau R1_t,  -(f_q q_e + f_v v_e + f_z z_e + tau f_t),
//                               (Phi_q q_e + tau Phi_t) / B)                                          at the stage
//      q' = q_e + B a*',  v*' = v_e + G a*',  z' = z_e + G_z f*'
//   2  P (u, eta)'    = -(V_q q' + tau V_t,  Phid_q q' + tau Phid_t + Phi_q v*'),  v' = v*' + u'
//   3  P (a, lambda)' = -(K q' + C v' - Q_z z' + tau R1_t,  Phidd_q q' + 2 Phid_q v' + tau Phidd_t),  f' likewise
//   4  alpha' = new_a a',  y' = new_f f'
// For the shortest of steps these become the rates of the motion.
#pragma once

#include "costate/assembly/time_partials.h"
#include "costate/discrete/discrete_scheme.h"

namespace costate {

/// A derivative of what a step hands on.
struct StepColumn {
  Eigen::VectorXd q, v, z, a, lambda, f, alpha, y;
  bool empty() const { return q.size() == 0; }
};

class StepLength {
 public:
  explicit StepLength(DiscreteScheme& scheme);

  /// Of the step that has just been taken, with its matrices. Leaves blocks of its end in the assembly.
  void calc();
  /// By its length where its end stays (tau = 0), and where it moves (tau = 1).
  const StepColumn& by_beginning() const { return columns_[0]; }
  const StepColumn& by_end() const { return columns_[1]; }

  /// The same of an instant in the place of a step, at the present state: q' = v, v' = a, z' = f.
  StepColumn of_instant() const;

 private:
  /// right_ := -(K q + C v - Q_z z, -(f_q q + f_v v + f_z z), 0) of both columns, and tau times the time partials.
  void put_force_rows();

  DiscreteScheme& scheme_;
  Assembly& assembly_;
  int n_, m_, nz_;
  StepColumn columns_[2];
  Eigen::MatrixXd right_;  // n + nz + m rows
  TimePartials time_;
  std::vector<double> hessian_, reaction_;
};

}  // namespace costate
