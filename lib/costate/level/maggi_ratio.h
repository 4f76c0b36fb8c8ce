// How far a choice of Maggi's independent coordinates is from the best one, of very many freedoms: R has too many
// columns for all of them to be looked at.
#pragma once

#include <vector>

#include "costate/level/maggi_chart.h"

namespace costate {

/// Of more freedoms the largest entry of R is searched for; of fewer all entries are looked at.
inline constexpr int kMostExactFreedoms = 256;

struct LargestRatio {
  double ratio = 0;  // |R_ij| weight[i] / weight[j of the coordinates]; infinite where the chart is singular
  int row = -1;      // i, a coordinate
  int column = -1;   // j, a place among the independent ones
};

/// An entry of R that is the largest of its row and its column, and of several such the largest: rows and columns are
/// followed from where products of R and R^T with random signs are largest. A lower bound of the largest of all, and
/// that itself as a rule; always where no row has more than one entry. Some 50 solutions with the chart's factors,
/// which are those of rows without redundant ones.
LargestRatio find_largest_ratio(MaggiChart& chart, const std::vector<double>& weight);

}  // namespace costate
