// Radau IIA of order 5 or 9 (s = 3 or 5 stages) for the linear descriptor systems of adjoint/hand_equations.h, forward
// or backward in time along a stored trajectory. Handles index 1 to 3 without change of form; momenta D X + d are
// carried as such. The gradient's integrand is summed with the scheme's own weights.
//
// Steps follow their error. With f = A X + b at the beginning of a step and at its stages, h times their divided
// difference of order s is the difference to an embedded formula of order s; passed through the step itself (S being
// its matrix, S^-1 of it is what the step would make of such a momentum) it does not exaggerate stiff components and
// leaves out what the constraints take away. The integrand's divided difference is held to the same tolerance. Source
// of scheme and estimate: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.5, IV.8 and VII.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "costate/adjoint/hand_equations.h"
#include "costate/integrator/linear_stages.h"
#include "costate/integrator/trajectory.h"

namespace costate {

struct RadauResult {
  Eigen::VectorXd gradient;
  long steps = 0, rejected = 0, factorizations = 0, evaluations = 0;
};

class RadauLinear {
 public:
  /// Called after each step with time and number of steps; may throw to stop.
  using Watch = std::function<void(double t, long steps)>;

  /// Sizes of the parameters: a column's error, and a parameter's share of the gradient, counts per relative change.
  RadauLinear(HandEquations& equations, const RadauScheme& scheme, std::vector<double> parameter_sizes);

  /// Integrates over the span of the grid (increasing times), stepping onto each of its points. The last instants
  /// before jumps of the motion must be among them (with_jumps()). `rtol` and `atol` are those of the trajectory: the
  /// result is to be about as accurate. With 0 the steps are those of the grid: in systems of index 3 the multipliers'
  /// error grows as the step falls, and the estimate with it. Throws SolverError naming time and row where a stage
  /// system is singular.
  RadauResult integrate(const Trajectory& trajectory, const std::vector<double>& grid, double rtol, double atol,
                        const Watch& watch = {});

 private:
  struct Stage {
    Eigen::MatrixXd X, b, d, f;
    Eigen::VectorXd integrand;
  };
  /// b and d of the evaluated point.
  void take_columns(Stage& s) const;
  /// f = A X + b
  void calc_flow(std::span<const double> A, Stage& s) const;
  /// D X + d at the evaluated point.
  void calc_momentum(const Eigen::MatrixXd& X, Eigen::MatrixXd& out) const;
  void begin_at(const Trajectory& trajectory, double t, const Eigen::MatrixXd& X);
  /// The jump of the motion whose last instant before it is t, or null.
  const MotionJump* jump_at(double t) const;
  /// Across it; the next step begins on the other side.
  void cross(const Trajectory& trajectory, const MotionJump& jump, Eigen::MatrixXd& X);
  /// The step from t0 to `next`: stages_ and what is called "after". Returns its error in tolerances.
  double attempt(const Trajectory& trajectory, double t0, double next, double tolerance, RadauResult& result);
  double state_error(double h, double tolerance);
  double integral_error(const Eigen::VectorXd& error, double tolerance);
  /// Of an adjoint, by group: what becomes of it where the motion is off by its absolute tolerance all along.
  Eigen::VectorXd change_by_tolerance(const Trajectory& trajectory, const std::vector<double>& grid, double atol);

  HandEquations& eq_;
  const RadauScheme& scheme_;
  int s_, N_, k_;
  std::vector<double> parameter_sizes_;
  LinearStages system_;
  double solve_tolerance_ = 0;  // of the stages
  long factorizations_before_ = 0;
  Stage begin_;
  std::vector<Stage> stages_;
  std::vector<double> point_;
  Eigen::MatrixXd momentum_, momentum_after_, right_;
  Eigen::MatrixXd size_, size_after_;  // of X by group and column, the largest met
  Eigen::VectorXd gradient_, gradient_after_;
  double gradient_size_ = 0, gradient_size_after_ = 0;
  double smallest_error_ = 0;          // that a step may always have, per relative change of a parameter
  Eigen::VectorXd smallest_of_group_;  // of an adjoint
};

}  // namespace costate
