// Numbers without a pattern, the same in every run: weights and states at which nothing vanishes or cancels by chance.
#pragma once

#include <cmath>
#include <vector>

namespace costate {

/// n numbers between -1 and 1; others for another seed.
inline std::vector<double> generic_numbers(std::size_t n, int seed) {
  std::vector<double> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = std::sin(2.3 * static_cast<double>(i + 1) + 1.7 * seed);
  return x;
}

}  // namespace costate
