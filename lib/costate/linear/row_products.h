// Products of a sparse matrix's rows with each other, A A^T, on a pattern that is worked out once.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "costate/linear/sparse_pattern.h"

namespace costate {

class RowProducts {
 public:
  /// The pattern must outlive this.
  explicit RowProducts(const SparsePattern& pattern);

  /// The lower triangle of A A^T, m x m with the diagonal; entries stay where they are zero.
  const Eigen::SparseMatrix<double>& of(const double* values);

 private:
  const SparsePattern& pattern_;
  Eigen::SparseMatrix<double> products_;
  std::vector<int> place_;  // of each pair of entries of a column, column by column
};

}  // namespace costate
