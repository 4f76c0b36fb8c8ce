#pragma once

#include <Eigen/Core>

#include "costate/linear/sparse_pattern.h"

namespace costate {

/// A matrix with values on a pattern, dense.
inline Eigen::MatrixXd to_dense(const SparsePattern& pattern, const double* values) {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(pattern.rows, pattern.cols);
  for (int j = 0; j < pattern.cols; ++j) {
    const auto column = static_cast<std::size_t>(j);
    for (auto k = pattern.column_start[column]; k < pattern.column_start[column + 1]; ++k)
      A(pattern.row[static_cast<std::size_t>(k)], j) = values[k];
  }
  return A;
}

}  // namespace costate
