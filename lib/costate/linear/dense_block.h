#pragma once

#include <Eigen/Core>
#include <vector>

#include "costate/linear/sparse_pattern.h"

namespace costate {

/// Rows and columns of a matrix with values on a pattern, dense; of a large one no more than these columns are walked.
inline Eigen::MatrixXd dense_block(const SparsePattern& pattern, const double* values, const std::vector<int>& rows,
                                   const std::vector<int>& columns) {
  std::vector<Eigen::Index> place(static_cast<std::size_t>(pattern.rows), -1);
  for (std::size_t i = 0; i < rows.size(); ++i) place[static_cast<std::size_t>(rows[i])] = static_cast<Eigen::Index>(i);
  Eigen::MatrixXd A =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t j = 0; j < columns.size(); ++j) {
    const auto column = static_cast<std::size_t>(columns[j]);
    for (auto k = pattern.column_start[column]; k < pattern.column_start[column + 1]; ++k)
      if (const auto i = place[static_cast<std::size_t>(pattern.row[static_cast<std::size_t>(k)])]; i >= 0)
        A(i, static_cast<Eigen::Index>(j)) = values[k];
  }
  return A;
}

}  // namespace costate
