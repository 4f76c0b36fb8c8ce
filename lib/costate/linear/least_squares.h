// Least squares with a large sparse matrix A of independent columns, and columns that depend on the others, both in
// time that is nearly linear in the entries: by LU factors of [-1 A; A^T 0] and by elimination. An orthogonal
// factorization (Eigen's SparseQR) takes minutes for ten thousand columns some of which are dependent.
#pragma once

#include <Eigen/SparseCore>
#include <optional>
#include <vector>

#include "costate/linear/inverse_norm.h"

namespace costate {

class LeastSquares {
 public:
  explicit LeastSquares(const Eigen::SparseMatrix<double>& A);

  /// Whether the columns are independent beyond doubt: the inverse of [-1 A; A^T 0], as large as that of A^T A, is of
  /// moderate size. The others are for such matrices.
  bool full_rank() { return saddle_.regular(1e12); }
  /// x with the least |A x - b|, for each column of b.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b);
  /// y with w^T solve(b) = y^T b for every b: A (A^T A)^-1 w.
  Eigen::VectorXd solve_transposed(const Eigen::VectorXd& w);

 private:
  Eigen::MatrixXd corrected(const Eigen::MatrixXd& right);
  Eigen::SparseMatrix<double> matrix_;
  SparseSquare saddle_;
  Eigen::Index rows_;
};

/// Columns of A without which the others are independent, found by elimination (the shortest first, each by its
/// largest entry): none more than there have to be, each proven to be a combination of the others. Nothing where
/// numbers leave a doubt or the elimination fills in. Columns of A have length 1.
std::optional<std::vector<int>> dependent_columns(const Eigen::SparseMatrix<double>& A);

}  // namespace costate
