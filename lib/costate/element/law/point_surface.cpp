#include "costate/element/law/point_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"

namespace costate {

namespace {
/// Coefficients of the cubic behind point k.
void cubic(const PointCurve& curve, std::size_t k, double* c, std::size_t stride) {
  double f[5];
  curve.calc_interval(k, curve.x()[k], f);
  c[0] = f[0];
  c[stride] = f[1];
  c[2 * stride] = f[2] / 2;
  c[3 * stride] = f[3] / 6;
}
}  // namespace

PointSurface::PointSurface(std::vector<double> x, std::vector<double> y, const std::vector<double>& z, Between between,
                           Beyond beyond, std::string source)
    : x_{std::move(x), "x"}, y_{std::move(y), "y"}, between_(between), beyond_(beyond), source_(std::move(source)) {
  require(x_);
  require(y_);
  const std::size_t nx = x_.knots.size(), ny = y_.knots.size();
  if (nx > kMostPoints / ny)
    throw ModelError("", fmt::format("{} has {} x {} points, more than {}.", source_, nx, ny, kMostPoints));
  if (z.size() != nx * ny)
    throw ModelError(
        "", fmt::format("{} needs {} values for {} x and {} y, found {}.", source_, nx * ny, nx, ny, z.size()));
  if (!std::all_of(z.begin(), z.end(), [](double v) { return std::isfinite(v); }))
    throw ModelError("", fmt::format("{} holds values that are no finite numbers.", source_));
  std::vector<PointCurve> rows;
  for (std::size_t j = 0; j < ny; ++j) {
    const auto first = z.begin() + static_cast<std::ptrdiff_t>(j * nx);
    rows.emplace_back(x_.knots, std::vector<double>(first, first + static_cast<std::ptrdiff_t>(nx)), between);
  }
  cubics_.resize(16 * (nx - 1) * (ny - 1));
  std::vector<double> along_x(4 * ny);
  for (std::size_t i = 0; i + 1 < nx; ++i) {
    for (std::size_t j = 0; j < ny; ++j) cubic(rows[j], i, &along_x[j], ny);
    for (std::size_t a = 0; a < 4; ++a) {
      const auto first = along_x.begin() + static_cast<std::ptrdiff_t>(a * ny);
      const PointCurve curve(y_.knots, std::vector<double>(first, first + static_cast<std::ptrdiff_t>(ny)), between);
      for (std::size_t j = 0; j + 1 < ny; ++j) cubic(curve, j, &cubics_[16 * (i * (ny - 1) + j) + 4 * a], 1);
    }
  }
}

void PointSurface::require(const Axis& axis) const {
  const auto& k = axis.knots;
  if (k.size() < 2)
    throw ModelError("", fmt::format("{} needs at least 2 places along {}, found {}.", source_, axis.name, k.size()));
  for (std::size_t i = 0; i < k.size(); ++i)
    if (!std::isfinite(k[i]) || (i > 0 && !(k[i] > k[i - 1])))
      throw ModelError("", fmt::format("The places of {} along {} must increase: {} comes after {}.", source_,
                                       axis.name, k[i], i > 0 ? k[i - 1] : k[i]));
}

PointSurface::Place PointSurface::place(const Axis& axis, double x) const {
  const auto& k = axis.knots;
  if (x < k.front() || x > k.back()) {
    const bool before = x < k.front();
    const double edge = before ? k.front() : k.back();
    // What rounding leaves of a motion's end.
    if (beyond_ == Beyond::refuse && std::abs(x - edge) > 1e-9 * (k.back() - k.front()))
      throw StepError(
          fmt::format("{} goes along {} from {:.9g} to {:.9g}, and is asked for at {:.9g}. Give it more points, or say "
                      "what holds there: beyond = \"hold\" or \"tangent\".",
                      source_, axis.name, k.front(), k.back(), x));
    const std::size_t interval = before ? 0 : k.size() - 2;
    return {interval, k[interval], edge - k[interval], false, beyond_ == Beyond::hold};
  }
  const auto above = std::upper_bound(k.begin() + 1, k.end() - 1, x);
  const auto interval = static_cast<std::size_t>(above - k.begin()) - 1;
  return {interval, k[interval], 0, true, false};
}

void PointSurface::add_bends(double x, double y, std::vector<double>& bends) const {
  const auto add = [&](const Axis& axis, double at) {
    const auto& k = axis.knots;
    const bool lines = between_ == Between::lines, holds = beyond_ == Beyond::hold;
    for (std::size_t i = 0; i < k.size(); ++i) {
      const bool edge = i == 0 || i + 1 == k.size();
      if (edge ? holds : lines) bends.push_back(at - k[i]);
    }
  };
  add(x_, x);
  add(y_, y);
}

}  // namespace costate
