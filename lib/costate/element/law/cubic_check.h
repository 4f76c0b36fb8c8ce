// How far a function is from the cubic through four of its values: whether it is resolved between two places.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace costate {

class CubicCheck {
 public:
  /// Through value(x_i).
  template <class Value>
  CubicCheck(const std::array<double, 4>& x, const Value& value) : x_(x) {
    for (std::size_t i = 0; i < 4; ++i) meet(f_[i] = value(x[i]));
  }
  /// One more of its values.
  void compare(double x, double f) {
    meet(f);
    double cubic = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      double term = f_[i];
      for (std::size_t j = 0; j < 4; ++j)
        if (j != i) term *= (x - x_[j]) / (x_[i] - x_[j]);
      cubic += term;
    }
    off_ = std::max(off_, std::abs(cubic - f));
  }
  /// The largest distance, and the range of all values so far.
  double off() const { return off_; }
  double range() const { return high_ - low_; }
  double low() const { return low_; }
  double high() const { return high_; }

 private:
  void meet(double f) {
    low_ = std::min(low_, f);
    high_ = std::max(high_, f);
  }
  std::array<double, 4> x_, f_{};
  double low_ = std::numeric_limits<double>::infinity(), high_ = -low_, off_ = 0;
};

}  // namespace costate
