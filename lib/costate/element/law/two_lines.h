// Whether a function is two lines that meet, as far as some of its values tell: a kink, at which nothing else happens.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace costate {

/// Values (x, f) in the order of x; `off` is how far each may be from its line, and the lines from each other between
/// the two values that they meet between. Three values at least lie on each.
inline bool are_two_lines(const std::vector<std::pair<double, double>>& values, double off) {
  const std::size_t n = values.size();
  const auto line = [&](std::size_t a, std::size_t b, double x) {
    const auto& [xa, fa] = values[a];
    const auto& [xb, fb] = values[b];
    return fa + (fb - fa) * ((x - xa) / (xb - xa));
  };
  const auto fits = [&](std::size_t a, std::size_t b) {
    for (std::size_t i = a; i <= b; ++i)
      if (!(std::abs(line(a, b, values[i].first) - values[i].second) <= off)) return false;
    return true;
  };
  for (std::size_t s = 2; s + 3 < n; ++s) {
    if (!fits(0, s)) return false;
    if (!fits(s + 1, n - 1)) continue;
    const double x0 = values[s].first, x1 = values[s + 1].first;
    const double d0 = line(0, s, x0) - line(s + 1, n - 1, x0), d1 = line(0, s, x1) - line(s + 1, n - 1, x1);
    if (d0 * d1 <= 0 || std::min(std::abs(d0), std::abs(d1)) <= off) return true;
  }
  return false;
}

}  // namespace costate
