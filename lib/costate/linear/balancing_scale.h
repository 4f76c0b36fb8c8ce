// Scales of a matrix's rows and columns, towards entries of which the largest of each row and of each column is 1 (by
// their roots, again and again): pivots then say what is dependent, and not what is in other units.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "costate/linear/sparse_pattern.h"

namespace costate {

enum class Balance {
  alike,   // rows by the scales of columns, so that a symmetric matrix stays one
  columns  // rows by their own, which are not wanted
};

/// Of the columns, powers of 2. size_of(k): the size of entry k.
template <class Size>
std::vector<double> balancing_scale(const SparsePattern& pattern, Balance balance, const Size& size_of) {
  constexpr int most = 20;
  const auto n = static_cast<std::size_t>(pattern.cols);
  std::vector<double> scale(n, 1.0), own(balance == Balance::alike ? 0 : n, 1.0), largest(n), own_largest(own.size());
  std::vector<double>&row_scale = own.empty() ? scale : own, &row_largest = own.empty() ? largest : own_largest;
  bool scaled = false;
  const auto weaken = [&](std::vector<double>& scales, const std::vector<double>& by) {
    for (std::size_t i = 0; i < scales.size(); ++i)
      if (by[i] > 0 && std::isfinite(by[i])) {
        scales[i] /= std::sqrt(by[i]);
        scaled = scaled && by[i] > 0.5 && by[i] < 2;
      }
  };
  for (int turn = 0; turn < most && !scaled; ++turn) {
    std::fill(largest.begin(), largest.end(), 0.0);
    std::fill(own_largest.begin(), own_largest.end(), 0.0);
    std::size_t k = 0;
    for (std::size_t j = 0; j < n; ++j)
      for (const auto end = static_cast<std::size_t>(pattern.column_start[j + 1]); k < end; ++k) {
        const auto i = static_cast<std::size_t>(pattern.row[k]);
        const double x = size_of(k) * row_scale[i] * scale[j];
        row_largest[i] = std::max(row_largest[i], x);
        largest[j] = std::max(largest[j], x);
      }
    scaled = true;
    weaken(scale, largest);
    weaken(own, own_largest);
  }
  for (double& c : scale) c = std::exp2(std::round(std::log2(c)));
  return scale;
}

}  // namespace costate
