// The uncoupled parts of a sparse matrix: sets of rows and columns between which it has no entries. What would be too
// large for dense algebra as a whole often is a row of small parts.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

namespace costate {

struct MatrixPart {
  std::vector<int> rows, columns;      // increasing; a part has at least one of either
  Eigen::SparseMatrix<double> matrix;  // rows x columns
};

/// Linear in the size of the matrix (but for the depth of a union-find); explicit zeros couple.
std::vector<MatrixPart> matrix_parts(const Eigen::SparseMatrix<double>& matrix);

}  // namespace costate
