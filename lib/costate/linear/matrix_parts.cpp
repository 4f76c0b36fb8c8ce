#include "costate/linear/matrix_parts.h"

#include <numeric>

namespace costate {

std::vector<MatrixPart> matrix_parts(const Eigen::SparseMatrix<double>& matrix) {
  using Entry = Eigen::SparseMatrix<double>::InnerIterator;
  const int rows = static_cast<int>(matrix.rows()), columns = static_cast<int>(matrix.cols());
  std::vector<int> parent(static_cast<std::size_t>(rows + columns));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    for (; parent[i] != i; i = parent[i]) parent[i] = parent[parent[i]];
    return i;
  };
  for (int j = 0; j < columns; ++j)
    for (Entry e(matrix, j); e; ++e) parent[root(static_cast<int>(e.row()))] = root(rows + j);
  std::vector<MatrixPart> parts;
  std::vector<int> part_of(parent.size(), -1), local(parent.size());
  for (int i = 0; i < rows + columns; ++i) {
    int& p = part_of[root(i)];
    if (p < 0) {
      p = static_cast<int>(parts.size());
      parts.emplace_back();
    }
    std::vector<int>& list = i < rows ? parts[p].rows : parts[p].columns;
    local[i] = static_cast<int>(list.size());
    list.push_back(i < rows ? i : i - rows);
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (MatrixPart& p : parts) {
    entries.clear();
    for (std::size_t j = 0; j < p.columns.size(); ++j)
      for (Entry e(matrix, p.columns[j]); e; ++e) entries.emplace_back(local[e.row()], static_cast<int>(j), e.value());
    p.matrix.resize(static_cast<int>(p.rows.size()), static_cast<int>(p.columns.size()));
    p.matrix.setFromTriplets(entries.begin(), entries.end());
    p.matrix.makeCompressed();
  }
  return parts;
}

}  // namespace costate
