// Accelerations, multipliers and all outputs at a state, found without the formulations: the equations of motion as a
// dense matrix of the assembly's blocks M, Phi_q, Q and bias, solved by an orthogonal decomposition.
#pragma once

#include <Eigen/QR>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/objective/output.h"
#include "costate/problem/problem.h"

namespace costate::app {

class IndependentState {
 public:
  /// A dense matrix of more unknowns would take too long.
  static constexpr int kMostUnknowns = 500;
  IndependentState(const Problem& problem, const std::vector<double>& rho);

  /// All but the time: coordinates, NAME_dot, NAME_ddot, lambda.ROW, z.STATE, and what elements measure.
  const std::vector<std::unique_ptr<Output>>& outputs() const { return outputs_; }
  bool affordable() const { return assembly_.n() + assembly_.m() <= kMostUnknowns; }

  /// Of (t, q, v, z) alone. `determined` (or null): which outputs the equations determine; with redundant rows
  /// multipliers are not unique, nor is what depends on them.
  std::vector<double> values(const StateView& s, std::vector<char>* determined = nullptr);
  struct ForceSizes {
    /// By unit, what accelerations without the constraints and multipliers that hold the forces alone amount to,
    /// roughly: the largest |Q_i|/M_ii, and |Q_i| over the largest entry of a row.
    std::map<std::string, double> by_unit;
    /// By name of an acceleration, what a multiplier makes of it by itself, M^-1 Phi_i^T lambda_i, the largest: of a
    /// box that slides on two corners the turn is what is left of their moments, and a pin rests by what holds it.
    std::map<std::string, double> by_reactions;
  };
  ForceSizes sizes_by_forces(const StateView& s);

 private:
  std::vector<double> outputs_at(const StateView& s, const Eigen::VectorXd& x);
  void add_sizes_by_reactions(const StateView& s, const Eigen::VectorXd& lambda, ForceSizes& largest);
  /// x = S scaled at a state whose dynamics have been calculated, and the scaled matrix with its factors.
  struct Solution {
    Eigen::VectorXd x, scaled, S;
    Eigen::MatrixXd A;
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factors;
  };
  Solution solve() const;
  Assembly assembly_;
  std::vector<std::unique_ptr<Output>> outputs_;
};

}  // namespace costate::app
