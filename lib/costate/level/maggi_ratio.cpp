#include "costate/level/maggi_ratio.h"

#include <cmath>
#include <limits>
#include <random>

#include "costate/base/stop.h"

namespace costate {

namespace {

constexpr int kProbes = 4, kMostMoves = 8;

class RatioSearch {
 public:
  RatioSearch(MaggiChart& chart, const std::vector<double>& weight)
      : chart_(chart),
        weight_(weight),
        n_(weight.size()),
        f_(chart.independent().size()),
        m_(static_cast<std::size_t>(chart.rows()) - f_),
        x_(static_cast<std::size_t>(chart.rows())) {}

  LargestRatio run() {
    std::mt19937 random(1);  // the same signs in every run
    const auto sign = [&] { return (random() & 1U) != 0 ? 1.0 : -1.0; };
    for (int p = 0; p < kProbes; ++p) {
      check_stop();
      clear();
      for (std::size_t j = 0; j < f_; ++j) x_[m_ + j] = sign() / weight_of_independent(j);
      chart_.solve(x_.data());
      if (!climb(largest_coordinate().row)) break;
      clear();
      for (std::size_t i = 0; i < n_; ++i) x_[i] = sign() * weight_[i];
      chart_.solve_transposed(x_.data());
      const int column = largest_independent().column;
      if (column < 0) {
        found_.ratio = std::numeric_limits<double>::infinity();
        break;
      }
      if (!climb(along_column(column).row)) break;
    }
    return found_;
  }

 private:
  double weight_of_independent(std::size_t j) const {
    return weight_[static_cast<std::size_t>(chart_.independent()[j])];
  }
  void clear() { std::fill(x_.begin(), x_.end(), 0.0); }

  // Of what a solution left in x; no row or column where that is not finite.
  LargestRatio largest_coordinate() const {
    LargestRatio r;
    for (std::size_t i = 0; i < n_; ++i) {
      const double size = std::abs(x_[i]) * weight_[i];
      if (!std::isfinite(size)) return {};
      if (r.row < 0 || size > r.ratio) r = {size, static_cast<int>(i), -1};
    }
    return r;
  }
  LargestRatio largest_independent() const {
    LargestRatio r;
    for (std::size_t j = 0; j < f_; ++j) {
      const double size = std::abs(x_[m_ + j]) / weight_of_independent(j);
      if (!std::isfinite(size)) return {};
      if (r.column < 0 || size > r.ratio) r = {size, -1, static_cast<int>(j)};
    }
    return r;
  }
  LargestRatio along_column(int j) {
    clear();
    x_[m_ + static_cast<std::size_t>(j)] = 1 / weight_of_independent(static_cast<std::size_t>(j));
    chart_.solve(x_.data());
    LargestRatio r = largest_coordinate();
    r.column = j;
    return r;
  }
  LargestRatio along_row(int i) {
    clear();
    x_[static_cast<std::size_t>(i)] = weight_[static_cast<std::size_t>(i)];
    chart_.solve_transposed(x_.data());
    LargestRatio r = largest_independent();
    r.row = i;
    return r;
  }

  /// False where the chart is singular.
  bool climb(int row) {
    double here = 0;
    for (int k = 0; k < kMostMoves && row >= 0; ++k) {
      const LargestRatio of_row = along_row(row);
      if (of_row.column < 0) break;
      if (of_row.ratio > found_.ratio) found_ = of_row;
      const LargestRatio of_column = along_column(of_row.column);
      if (of_column.row < 0) break;
      if (of_column.ratio > found_.ratio) found_ = of_column;
      if (!(of_column.ratio > here) || of_column.row == row) return true;
      here = of_column.ratio;
      row = of_column.row;
      if (k + 1 == kMostMoves) return true;
    }
    found_.ratio = std::numeric_limits<double>::infinity();
    return false;
  }

  MaggiChart& chart_;
  const std::vector<double>& weight_;
  std::size_t n_, f_, m_;
  std::vector<double> x_;
  LargestRatio found_;
};

}  // namespace

LargestRatio find_largest_ratio(MaggiChart& chart, const std::vector<double>& weight) {
  return RatioSearch(chart, weight).run();
}

}  // namespace costate
