// A dense matrix X of constraint rows with its rank, its null space and its pseudo-inverse: redundant rows,
// and none at all, are as good as others. For analyses of single points, not for runs.
#pragma once

#include <Eigen/Dense>

namespace costate {

class RowSpace {
 public:
  void compute(const Eigen::MatrixXd& X);
  const Eigen::MatrixXd& matrix() const { return X_; }
  int rank() const { return rank_; }
  /// Orthonormal columns N with X N = 0.
  Eigen::MatrixXd null_space() const;
  /// X^+ b and (X^T)^+ b: the solutions of least squares and least norm.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;
  Eigen::MatrixXd solve_transposed(const Eigen::MatrixXd& b) const;

 private:
  Eigen::MatrixXd X_;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> transposed_;
  int rank_ = 0;
};

}  // namespace costate
