// Radau IIA of three stages (order 5) for the linear descriptor systems of adjoint/hand_equations.h, forward or
// backward in time along a stored trajectory. Handles index 1 to 3 without change of form; momenta D X + d are carried
// as such. The gradient's integrand is summed with the scheme's own weights.
// Source of the scheme: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.5 and VII.
#pragma once

#include <functional>
#include <vector>

#include "costate/adjoint/hand_equations.h"
#include "costate/integrator/trajectory.h"
#include "costate/linear/klu_solver.h"

namespace costate {

struct RadauResult {
  Eigen::VectorXd gradient;
  long steps = 0, factorizations = 0, evaluations = 0;
};

class RadauLinear {
 public:
  explicit RadauLinear(HandEquations& equations);

  /// Integrates over the grid (increasing times); `observe`, if given, sees (t, X) at each grid point in the order of
  /// integration. Throws SolverError naming time and row where a stage system is singular.
  RadauResult integrate(const Trajectory& trajectory, const std::vector<double>& grid,
                        const std::function<void(double, const Eigen::MatrixXd&)>& observe = {});

 private:
  void fill_stage(int i, double h);
  void equilibrate();
  HandEquations& eq_;
  int N_, k_;
  BlockMatrix stages_;
  KluSolver* solver() { return solver_.get(); }
  std::unique_ptr<KluSolver> solver_;
  std::vector<double> scaled_;    // the stage matrix as factored
  Eigen::ArrayXd column_scale_;
  SparsePattern differential_rows_;           // the equations' pattern without algebraic rows
  std::vector<std::int64_t> differential_of_;  // positions of its entries in the full pattern
  int block_[3][3] = {};
  std::vector<double> values_, part_;
};

}  // namespace costate
