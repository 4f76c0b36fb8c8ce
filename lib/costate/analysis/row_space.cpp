#include "costate/analysis/row_space.h"

namespace costate {

using Eigen::MatrixXd;

namespace {
constexpr double kRowRankTolerance = 1e-9;  // as find_start has it
}

void RowSpace::compute(const MatrixXd& X) {
  X_ = X;
  rank_ = 0;
  if (X.rows() == 0) return;
  transposed_.setThreshold(kRowRankTolerance);
  transposed_.compute(X.transpose());
  rank_ = static_cast<int>(transposed_.rank());
}

MatrixXd RowSpace::null_space() const {
  const Eigen::Index n = X_.cols();
  if (X_.rows() == 0) return MatrixXd::Identity(n, n);
  return MatrixXd(transposed_.householderQ() * MatrixXd::Identity(n, n)).rightCols(n - rank_);
}

MatrixXd RowSpace::solve(const MatrixXd& b) const {
  if (X_.rows() == 0 || b.cols() == 0) return MatrixXd::Zero(X_.cols(), b.cols());
  return transposed_.transpose().solve(b);
}

MatrixXd RowSpace::solve_transposed(const MatrixXd& b) const {
  if (X_.rows() == 0 || b.cols() == 0) return MatrixXd::Zero(X_.rows(), b.cols());
  return transposed_.solve(b);
}

}  // namespace costate
