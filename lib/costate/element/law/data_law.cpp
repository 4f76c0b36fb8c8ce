#include "costate/element/law/data_law.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"

namespace costate {

DataLaw::DataLaw(std::vector<double> x, std::vector<double> y, Between between, Beyond beyond, std::string source)
    : x_(std::move(x)), y_(std::move(y)), between_(between), beyond_(beyond), source_(std::move(source)) {
  const std::size_t n = x_.size();
  if (n < 2 || n != y_.size())
    throw ModelError("", fmt::format("A law through data needs at least 2 points, found {} in {}.", n, source_));
  for (std::size_t i = 1; i < n; ++i)
    if (!(x_[i] > x_[i - 1]))
      throw ModelError("",
                       fmt::format("The places of {} must increase: {} comes after {}.", source_, x_[i], x_[i - 1]));
  moment_.assign(n, 0.0);
  if (between_ == Between::lines) return;
  // The tridiagonal system of the spline's second derivatives, zero at both ends.
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

void DataLaw::add_kinks(const double*, std::vector<double>& x) const {
  const bool lines = between_ == Between::lines;
  // Where the end's values are held the slope jumps there, too.
  const std::size_t skip = beyond_ == Beyond::hold ? 0 : 1;
  if (lines)
    x.insert(x.end(), x_.begin() + static_cast<std::ptrdiff_t>(skip), x_.end() - static_cast<std::ptrdiff_t>(skip));
  else if (skip == 0)
    x.insert(x.end(), {x_.front(), x_.back()});
}

void DataLaw::add_places(const double*, LawPlaces& places) const {
  auto& of = between_ == Between::lines ? places.sharp : places.knots;
  of.insert(of.end(), x_.begin(), x_.end());
}

void DataLaw::interval(std::size_t k, double x, double* f) const {
  const double h = x_[k + 1] - x_[k], secant = (y_[k + 1] - y_[k]) / h, m0 = moment_[k], m1 = moment_[k + 1];
  const double b = (x - x_[k]) / h, a = 1 - b;
  f[0] = a * y_[k] + b * y_[k + 1] + h * h / 6 * ((a * a * a - a) * m0 + (b * b * b - b) * m1);
  f[1] = secant + h / 6 * ((3 * b * b - 1) * m1 - (3 * a * a - 1) * m0);
  f[2] = a * m0 + b * m1;
  f[3] = (m1 - m0) / h;
  f[4] = 0;
}

void DataLaw::calc_derivatives(double x, double* f) const {
  const bool before = x<x_.front(), after = x> x_.back();
  if (before || after) {
    const double end = before ? x_.front() : x_.back(), span = x_.back() - x_.front();
    // What rounding leaves of a run's end.
    const double near = 1e-9 * span;
    if (beyond_ == Beyond::refuse && std::abs(x - end) > near)
      throw StepError(
          fmt::format("{} goes from {:.9g} to {:.9g}, and is asked for at {:.9g}. Shorten the run, or say "
                      "what holds there: beyond = \"hold\" or \"tangent\".",
                      source_, x_.front(), x_.back(), x));
    interval(before ? 0 : x_.size() - 2, end, f);
    if (beyond_ == Beyond::hold) f[1] = 0;
    f[0] += f[1] * (x - end);
    f[2] = f[3] = f[4] = 0;
    return;
  }
  const auto above = std::upper_bound(x_.begin() + 1, x_.end() - 1, x);
  interval(static_cast<std::size_t>(above - x_.begin()) - 1, x, f);
}

// By Simpson's rule, which is exact for cubics.
double DataLaw::area(std::size_t k, double a, double b) const {
  double fa[5], fm[5], fb[5];
  interval(k, a, fa);
  interval(k, 0.5 * (a + b), fm);
  interval(k, b, fb);
  return (b - a) / 6 * (fa[0] + 4 * fm[0] + fb[0]);
}

double DataLaw::area_to(double x) const {
  double f[5], sum = 0;
  for (std::size_t k = 0; k + 1 < x_.size() && x_[k] < x; ++k) sum += area(k, x_[k], std::min(x, x_[k + 1]));
  if (x >= x_.front() && x <= x_.back()) return sum;
  const double end = x < x_.front() ? x_.front() : x_.back();
  calc_derivatives(x, f);
  const double far = f[0];
  calc_derivatives(end, f);
  return sum + 0.5 * (far + f[0]) * (x - end);
}

double DataLaw::integral(double x, const double* p) const {
  const bool reaches = beyond_ != Beyond::refuse || (x_.front() <= 0 && 0 <= x_.back());
  return p[0] * (area_to(x) - (reaches ? area_to(0) : 0));
}

}  // namespace costate
