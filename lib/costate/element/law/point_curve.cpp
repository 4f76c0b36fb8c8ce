#include "costate/element/law/point_curve.h"

#include <algorithm>
#include <utility>

namespace costate {

PointCurve::PointCurve(std::vector<double> x, std::vector<double> y, Between between, bool repeats)
    : x_(std::move(x)), y_(std::move(y)), moment_(x_.size(), 0.0) {
  if (between == Between::lines) return;
  if (repeats) {
    solve_repeated();
    return;
  }
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

// The same system closed to a ring: with A its tridiagonal part but for what makes A + u w^T of it, u = (c, 0, ..., b),
// w = (1, 0, ..., b/c), two solutions of A give that of the ring (Sherman and Morrison).
void PointCurve::solve_repeated() {
  const std::size_t n = x_.size() - 1;
  if (n < 2) return;  // a constant
  const auto h = [&](std::size_t k) { return x_[k % n + 1] - x_[k % n]; };
  const auto secant = [&](std::size_t k) { return (y_[k % n + 1] - y_[k % n]) / h(k); };
  const double corner = h(n - 1) / 6;  // between the first and the last
  std::vector<double> diagonal(n), rhs(n), u(n, 0.0), upper(n, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    diagonal[k] = (h(k + n - 1) + h(k)) / 3;
    rhs[k] = secant(k) - secant(k + n - 1);
  }
  if (n == 2) {
    // Both neighbours of a point are the other one.
    const double off = (h(0) + h(1)) / 6, det = diagonal[0] * diagonal[1] - off * off;
    moment_ = {(diagonal[1] * rhs[0] - off * rhs[1]) / det, (diagonal[0] * rhs[1] - off * rhs[0]) / det, 0};
    moment_[2] = moment_[0];
    return;
  }
  const double c = -diagonal[0];
  diagonal[0] -= c;
  diagonal[n - 1] -= corner * corner / c;
  u[0] = c;
  u[n - 1] = corner;
  for (std::size_t k = 0; k < n; ++k) {
    const double lower = k > 0 ? h(k - 1) / 6 : 0, pivot = diagonal[k] - (k > 0 ? lower * upper[k - 1] : 0);
    upper[k] = h(k) / 6 / pivot;
    rhs[k] = (rhs[k] - (k > 0 ? lower * rhs[k - 1] : 0)) / pivot;
    u[k] = (u[k] - (k > 0 ? lower * u[k - 1] : 0)) / pivot;
  }
  for (std::size_t k = n - 1; k-- > 0;) {
    rhs[k] -= upper[k] * rhs[k + 1];
    u[k] -= upper[k] * u[k + 1];
  }
  const double part = (rhs[0] + corner / c * rhs[n - 1]) / (1 + u[0] + corner / c * u[n - 1]);
  for (std::size_t k = 0; k < n; ++k) moment_[k] = rhs[k] - part * u[k];
  moment_[n] = moment_[0];
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
