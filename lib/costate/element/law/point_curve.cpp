#include "costate/element/law/point_curve.h"

#include <algorithm>
#include <utility>

namespace costate {

PointCurve::PointCurve(std::vector<double> x, std::vector<double> y, Between between)
    : x_(std::move(x)), y_(std::move(y)), moment_(x_.size(), 0.0) {
  if (between == Between::lines) return;
  // The tridiagonal system of the spline's second derivatives, zero at both ends.
  const std::size_t n = x_.size();
  std::vector<double> upper(n, 0.0);
  for (std::size_t k = 1; k + 1 < n; ++k) {
    const double left = x_[k] - x_[k - 1], right = x_[k + 1] - x_[k];
    const double rhs = (y_[k + 1] - y_[k]) / right - (y_[k] - y_[k - 1]) / left;
    const double pivot = (left + right) / 3 - left / 6 * upper[k - 1];
    upper[k] = right / 6 / pivot;
    moment_[k] = (rhs - left / 6 * moment_[k - 1]) / pivot;
  }
  for (std::size_t k = n - 1; k-- > 1;) moment_[k] -= upper[k] * moment_[k + 1];
}

void PointCurve::calc_interval(std::size_t k, double x, double* f) const {
  const double h = x_[k + 1] - x_[k], secant = (y_[k + 1] - y_[k]) / h, m0 = moment_[k], m1 = moment_[k + 1];
  const double b = (x - x_[k]) / h, a = 1 - b;
  f[0] = a * y_[k] + b * y_[k + 1] + h * h / 6 * ((a * a * a - a) * m0 + (b * b * b - b) * m1);
  f[1] = secant + h / 6 * ((3 * b * b - 1) * m1 - (3 * a * a - 1) * m0);
  f[2] = a * m0 + b * m1;
  f[3] = (m1 - m0) / h;
  f[4] = 0;
}

void PointCurve::calc_derivatives(double x, double* f) const {
  const auto above = std::upper_bound(x_.begin() + 1, x_.end() - 1, x);
  const auto k = static_cast<std::size_t>(above - x_.begin()) - 1;
  const bool before = x<x_.front(), after = x> x_.back();
  const double end = before ? x_.front() : x_.back();
  calc_interval(k, before || after ? end : x, f);
  if (!before && !after) return;
  f[0] += f[1] * (x - end);
  f[2] = f[3] = f[4] = 0;
}

}  // namespace costate
