#include "costate/linear/row_products.h"

#include <algorithm>

namespace costate {

RowProducts::RowProducts(const SparsePattern& pattern) : pattern_(pattern) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < pattern.rows; ++i) entries.emplace_back(i, i, 0.0);
  const auto for_each_pair = [&](auto&& f) {
    for (std::size_t j = 0; j < static_cast<std::size_t>(pattern.cols); ++j)
      for (auto a = pattern.column_start[j]; a < pattern.column_start[j + 1]; ++a)
        for (auto b = a; b < pattern.column_start[j + 1]; ++b)
          f(static_cast<int>(pattern.row[static_cast<std::size_t>(b)]),
            static_cast<int>(pattern.row[static_cast<std::size_t>(a)]));
  };
  for_each_pair([&](int i, int j) { entries.emplace_back(i, j, 0.0); });
  products_.resize(pattern.rows, pattern.rows);
  products_.setFromTriplets(entries.begin(), entries.end());
  place_.reserve(entries.size());
  for_each_pair([&](int i, int j) {
    const int* first = products_.innerIndexPtr() + products_.outerIndexPtr()[j];
    const int* last = products_.innerIndexPtr() + products_.outerIndexPtr()[j + 1];
    place_.push_back(static_cast<int>(std::lower_bound(first, last, i) - products_.innerIndexPtr()));
  });
}

const Eigen::SparseMatrix<double>& RowProducts::of(const double* values) {
  double* out = products_.valuePtr();
  std::fill(out, out + products_.nonZeros(), 0.0);
  const int* place = place_.data();
  for (std::size_t j = 0; j < static_cast<std::size_t>(pattern_.cols); ++j)
    for (auto a = pattern_.column_start[j]; a < pattern_.column_start[j + 1]; ++a)
      for (auto b = a; b < pattern_.column_start[j + 1]; ++b) out[*place++] += values[a] * values[b];
  return products_;
}

}  // namespace costate
