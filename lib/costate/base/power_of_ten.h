// Units of tolerances are powers of ten, so that they hardly ever move with a parameter.
#pragma once

#include <cmath>

namespace costate {

/// The power of ten next above x > 0.
inline double power_of_ten_above(double x) { return std::pow(10.0, std::floor(std::log10(x)) + 1); }

}  // namespace costate
