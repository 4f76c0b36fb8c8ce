// The absolute tolerance of a cost's quadrature. The state is known to w = rtol |y| + atol, which leaves the cost known
// to about the integral of |g_y|^T w and no better; it has to be integrated as well as that, whatever its size: a cost
// of 1e-6, of a motion that is slow or late, would have no digit by the absolute tolerance of the coordinates. Not
// below one millionth of that, where a motion at rest is nothing but rounding.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace costate {

class CostTolerance {
 public:
  CostTolerance() = default;
  /// The coordinates' own, in the cost's unit; over the run's length.
  CostTolerance(double usual, double span) : usual_(usual), span_(span) {}

  /// With g_y at y, both of n entries, and the absolute tolerances of y. True where the tolerance has changed by much.
  bool sample(int n, const double* g_y, const double* y, double rtol, const double* atol) {
    double known = 0;
    for (int i = 0; i < n; ++i) known += std::abs(g_y[i]) * (rtol * std::abs(y[i]) + atol[i]);
    return raise(known);
  }
  /// The same of a derivative along a tangent s, whose tolerances are atol_s; g_near is g_y at y + w.
  bool sample(int n, const double* g_y, const double* g_near, const double* s, double rtol, const double* atol_s) {
    double known = 0;
    for (int i = 0; i < n; ++i)
      known += std::abs(g_y[i]) * (rtol * std::abs(s[i]) + atol_s[i]) + std::abs((g_near[i] - g_y[i]) * s[i]);
    return raise(known);
  }
  double value() const { return std::clamp(largest_ * span_, kLeast * usual_, usual_); }

 private:
  static constexpr double kLeast = 1e-6, kMuch = 1.5;
  bool raise(double known) {
    largest_ = std::max(largest_, known);
    if (told_ > 0 && value() <= kMuch * told_) return false;
    told_ = value();
    return true;
  }

  double usual_ = 0, span_ = 0, largest_ = 0, told_ = 0;
};

}  // namespace costate
