#include "costate/linear/inverse_norm.h"

#include <cmath>

#include "costate/base/error.h"

namespace costate {

using Eigen::VectorXd;

SparseSquare::SparseSquare(const Eigen::SparseMatrix<double>& matrix) {
  pattern_.rows = static_cast<int>(matrix.rows());
  pattern_.cols = static_cast<int>(matrix.cols());
  std::vector<double> values;
  pattern_.column_start.push_back(0);
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator e(matrix, j); e; ++e) {
      pattern_.row.push_back(e.row());
      values.push_back(e.value());
    }
    pattern_.column_start.push_back(static_cast<std::int64_t>(pattern_.row.size()));
  }
  try {
    solver_ = std::make_unique<KluSolver>(pattern_);
  } catch (const Error&) {
    return;
  }
  factored_ = solver_->factor(values.data()) < 0;
}

double SparseSquare::inverse_norm() {
  const Eigen::Index n = pattern_.cols;
  VectorXd x = VectorXd::Constant(n, 1.0 / static_cast<double>(n));
  double norm = 0;
  Eigen::Index last = -1;
  for (int i = 0; i < 5; ++i) {
    solver_->solve(x.data());
    const double found = x.lpNorm<1>();
    if (!std::isfinite(found)) return found;
    if (!(found > norm)) break;
    norm = found;
    VectorXd sign = x.unaryExpr([](double e) { return e < 0 ? -1.0 : 1.0; });
    solver_->solve_transposed(sign.data());
    Eigen::Index largest;
    sign.cwiseAbs().maxCoeff(&largest);
    if (largest == last) break;
    x = VectorXd::Unit(n, last = largest);
  }
  // Higham's vector, against matrices for which the steps above stop early.
  for (Eigen::Index i = 0; i < n; ++i)
    x[i] = (i % 2 == 0 ? 1 : -1) * (1 + static_cast<double>(i) / std::max<double>(1, static_cast<double>(n - 1)));
  solver_->solve(x.data());
  return std::max(norm, 2 * x.lpNorm<1>() / (3 * static_cast<double>(n)));
}

bool SparseSquare::regular(double limit) {
  return factored_ && (pattern_.cols == 0 || inverse_norm() < limit);  // false for what is not finite
}

Eigen::MatrixXd SparseSquare::solve(const Eigen::MatrixXd& b) {
  Eigen::MatrixXd x = b;
  if (x.size() > 0) solver_->solve(x.data(), static_cast<int>(x.cols()));
  return x;
}

Eigen::VectorXd SparseSquare::solve_transposed(const Eigen::VectorXd& b) {
  Eigen::VectorXd x = b;
  if (x.size() > 0) solver_->solve_transposed(x.data());
  return x;
}

}  // namespace costate
