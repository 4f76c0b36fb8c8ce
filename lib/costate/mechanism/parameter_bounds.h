// Bounds of parameters, and what rounding makes of them.
#pragma once

#include <cmath>
#include <limits>

#include "costate/mechanism/parameter.h"

namespace costate {

/// A value as the factors of numbers leave it, 3 * 0.1 / 3 say, which is above 0.1: within rounding of a bound it is
/// that bound.
inline double rounded_to_bounds(const Parameter& p, double value) {
  constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();
  for (const double bound : {p.lower, p.upper})
    if (std::isfinite(bound) && std::abs(value - bound) <= kRounding * std::abs(bound)) return bound;
  return value;
}

}  // namespace costate
