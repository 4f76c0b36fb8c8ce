// A number with what rounding may make of it: the error of each operation, carried to the first order through all that
// follow. Tells a function's noise, where large terms cancel, from what it does.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace costate {

struct Rounded {
  double v = 0, error = 0;
  constexpr Rounded() = default;
  Rounded(double value)  // NOLINT: implicit by design, a constant is a number
      : Rounded(value, 0) {}
  /// The result of an operation with the error of what went into it.
  Rounded(double value, double error_of_input)
      : v(value), error(error_of_input + std::numeric_limits<double>::epsilon() * std::abs(value)) {}

  Rounded& operator+=(const Rounded& o) { return *this = Rounded(v + o.v, error + o.error); }
  Rounded& operator-=(const Rounded& o) { return *this = Rounded(v - o.v, error + o.error); }
  Rounded& operator*=(const Rounded& o) {
    return *this = Rounded(v * o.v, std::abs(v) * o.error + std::abs(o.v) * error);
  }
  Rounded& operator/=(const Rounded& o) {
    return *this = Rounded(v / o.v, (error + std::abs(v / o.v) * o.error) / std::abs(o.v));
  }
  friend Rounded operator*(Rounded a, const Rounded& b) { return a *= b; }
  friend Rounded operator/(Rounded a, const Rounded& b) { return a /= b; }
  friend Rounded operator-(const Rounded& a) { return {-a.v, a.error}; }
};

inline double value_of(const Rounded& x) { return x.v; }
inline bool is_constant(const Rounded&) { return true; }  // it has none

inline Rounded sqrt(const Rounded& x) {
  const double r = std::sqrt(x.v);
  return {r, x.error / std::max(2 * r, std::sqrt(x.error) + std::numeric_limits<double>::min())};
}
inline Rounded sin(const Rounded& x) { return {std::sin(x.v), std::abs(std::cos(x.v)) * x.error}; }
inline Rounded cos(const Rounded& x) { return {std::cos(x.v), std::abs(std::sin(x.v)) * x.error}; }
inline Rounded exp(const Rounded& x) { return {std::exp(x.v), std::exp(x.v) * x.error}; }
inline Rounded log(const Rounded& x) { return {std::log(x.v), x.error / std::abs(x.v)}; }
inline Rounded tanh(const Rounded& x) {
  const double f = std::tanh(x.v);
  return {f, (1 - f * f) * x.error};
}
inline Rounded atan(const Rounded& x) { return {std::atan(x.v), x.error / (1 + x.v * x.v)}; }

}  // namespace costate
