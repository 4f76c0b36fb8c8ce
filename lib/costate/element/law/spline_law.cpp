#include "costate/element/law/spline_law.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"

namespace costate {

SplineLaw::SplineLaw(std::vector<double> x) : x_(std::move(x)) {
  const std::size_t n = x_.size();
  if (n < 2) throw ModelError("", fmt::format("A table needs at least 2 points, found {}.", n));
  for (std::size_t i = 1; i < n; ++i)
    if (!(x_[i] > x_[i - 1]))
      throw ModelError(
          "", fmt::format("A table's abscissae must increase: entry {} is {} after {}.", i + 1, x_[i], x_[i - 1]));
  diagonal_.assign(n, 0.0);
  down_ = up_ = diagonal_;
  first_.assign(n, 0);
  last_.assign(n, 0);
  if (n == 2) return;
  const auto h = [&](std::size_t k) { return x_[k + 1] - x_[k]; };
  std::vector<double> d(n, 0.0), e(n, 0.0);
  for (std::size_t k = 1; k + 1 < n; ++k) {
    d[k] = (h(k - 1) + h(k)) / 3 - (k > 1 ? h(k - 1) / 6 * (h(k - 1) / 6) / d[k - 1] : 0);
    down_[k] = -h(k) / 6 / d[k];
  }
  for (std::size_t k = n - 2; k >= 1; --k) {
    e[k] = (h(k - 1) + h(k)) / 3 - (k + 2 < n ? h(k) / 6 * (h(k) / 6) / e[k + 1] : 0);
    up_[k] = -h(k - 1) / 6 / e[k];
  }
  // The weight of y about knot j in its bend, and the largest on either side of j: where the steps differ by orders of
  // magnitude, a knot far away may weigh more than those between.
  std::vector<double> weight(n, 0.0), before(n, 0.0), after(n, 0.0);
  for (std::size_t k = 1; k + 1 < n; ++k) {
    diagonal_[k] = 1 / (d[k] + e[k] - (h(k - 1) + h(k)) / 3);
    weight[k] = 1 / h(k - 1) + 1 / h(k);
  }
  for (std::size_t k = 1; k + 1 < n; ++k) before[k] = std::max(before[k - 1], weight[k]);
  for (std::size_t k = n - 2; k >= 1; --k) after[k] = std::max(after[k + 1], weight[k]);
  constexpr double kNothing = 1e-30;
  for (std::size_t k = 1; k + 1 < n; ++k) {
    double product = 1, most = weight[k];
    std::size_t j = k;
    for (; j > 1; --j) {
      product *= std::abs(down_[j - 1]);
      most = std::max(most, product * weight[j - 1]);
      if (product * before[j - 1] < kNothing * most) break;
    }
    first_[k] = static_cast<int>(j);
    product = 1;
    for (j = k; j + 2 < n; ++j) {
      product *= std::abs(up_[j + 1]);
      most = std::max(most, product * weight[j + 1]);
      if (product * after[j + 1] < kNothing * most) break;
    }
    last_[k] = static_cast<int>(j);
  }
}

void SplineLaw::add_places(const double*, LawPlaces& places) const {
  places.knots.insert(places.knots.end(), x_.begin(), x_.end());
}

}  // namespace costate
