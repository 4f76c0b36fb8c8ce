// The size of a sparse matrix's inverse, by which a large regular matrix is known without an orthogonal factorization.
#pragma once

#include <Eigen/SparseCore>
#include <memory>

#include "costate/linear/klu_solver.h"

namespace costate {

/// A square sparse matrix factored by KLU; regular() where its inverse is known to be of moderate size.
class SparseSquare {
 public:
  explicit SparseSquare(const Eigen::SparseMatrix<double>& matrix);

  /// ||A^-1||_1 < `limit`, as Hager's method estimates it (a lower bound, within a factor of three as a rule); false
  /// also where no pivots are found.
  bool regular(double limit);
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b);
  Eigen::VectorXd solve_transposed(const Eigen::VectorXd& b);

 private:
  double inverse_norm();

  SparsePattern pattern_;
  std::unique_ptr<KluSolver> solver_;  // null: structurally singular
  bool factored_ = false;
};

}  // namespace costate
