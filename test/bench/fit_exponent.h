// How a cost grows with the size of a problem.
#pragma once

#include <cmath>
#include <vector>

namespace costate::bench {

/// The exponent p of y = c x^p by least squares in log-log, of those points whose y is positive: a difference of two
/// times need not be. Not a number of less than two.
inline double fit_exponent(const std::vector<double>& x, const std::vector<double>& y) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!(y[i] > 0)) continue;
    const double a = std::log(x[i]), b = std::log(y[i]);
    n += 1;
    sx += a;
    sy += b;
    sxx += a * a;
    sxy += a * b;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace costate::bench
