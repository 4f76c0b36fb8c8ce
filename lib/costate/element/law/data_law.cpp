#include "costate/element/law/data_law.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"

namespace costate {

DataLaw::DataLaw(std::vector<double> x, std::vector<double> y, Between between, Beyond beyond, std::string source,
                 std::string column, std::string unit, std::string argument, std::string argument_unit)
    : between_(between),
      beyond_(beyond),
      source_(std::move(source)),
      column_(std::move(column)),
      unit_(std::move(unit)),
      argument_(std::move(argument)),
      argument_unit_(std::move(argument_unit)) {
  const std::size_t n = x.size();
  if (n < 2 || n != y.size())
    throw ModelError("", fmt::format("A law through data needs at least 2 points, found {} in {}.", n, source_));
  for (std::size_t i = 1; i < n; ++i)
    if (!(x[i] > x[i - 1]))
      throw ModelError("", fmt::format("The places of {} must increase: {} comes after {}.", source_, x[i], x[i - 1]));
  if (beyond_ == Beyond::repeat) {
    if (between_ == Between::lines)
      throw ModelError("",
                       fmt::format("{} can repeat as a spline alone (between = \"spline\"): lines would have a kink "
                                   "at the places of all lengths.",
                                   source_));
    if (y.front() != y.back())
      throw ModelError("", fmt::format("{} begins with {} and ends with {}: what repeats must end as it begins.",
                                       source_, y.front(), y.back()));
  }
  curve_ = PointCurve(std::move(x), std::move(y), between, beyond_ == Beyond::repeat);
}

void DataLaw::add_kinks(const double*, std::vector<double>& x) const {
  const std::vector<double>& at = curve_.x();
  const bool lines = between_ == Between::lines;
  // Where the end's values are held the slope jumps there, too.
  const std::size_t skip = beyond_ == Beyond::hold ? 0 : 1;
  if (lines)
    x.insert(x.end(), at.begin() + static_cast<std::ptrdiff_t>(skip), at.end() - static_cast<std::ptrdiff_t>(skip));
  else if (skip == 0)
    x.insert(x.end(), {at.front(), at.back()});
}

void DataLaw::add_places(const double*, LawPlaces& places) const {
  auto& of = between_ == Between::lines ? places.sharp : places.knots;
  if (beyond_ != Beyond::repeat) {
    of.insert(of.end(), curve_.x().begin(), curve_.x().end());
    return;
  }
  constexpr double kMostPlaces = 100'000;
  double first = lengths(places.from), last = lengths(places.to);
  // Without bounds, or over very many lengths: of one.
  if (!((last - first + 1) * static_cast<double>(curve_.x().size()) <= kMostPlaces)) first = last = 0;
  for (double k = first; k <= last; ++k)
    for (const double x : curve_.x()) of.push_back(x + k * length());
}

double DataLaw::lengths(double x) const { return std::floor((x - curve_.x().front()) / length()); }

void DataLaw::calc_derivatives(double x, double* f) const {
  const double first = curve_.x().front(), last = curve_.x().back();
  const bool before = x<first, after = x> last;
  if (!before && !after) return curve_.calc_derivatives(x, f);
  if (beyond_ == Beyond::repeat) return curve_.calc_derivatives(std::clamp(x - lengths(x) * length(), first, last), f);
  const double end = before ? first : last;
  // What rounding leaves of a run's end.
  const double near = 1e-9 * (last - first);
  if (beyond_ == Beyond::refuse && std::abs(x - end) > near)
    throw StepError(
        fmt::format("{} goes from {:.9g} to {:.9g}, and is asked for at {:.9g}. Shorten the run, or say "
                    "what holds there: beyond = \"hold\", \"tangent\" or \"repeat\".",
                    source_, first, last, x));
  if (beyond_ != Beyond::hold) return curve_.calc_derivatives(x, f);
  curve_.calc_derivatives(end, f);
  f[1] = f[2] = f[3] = f[4] = 0;
}

// By Simpson's rule, which is exact for cubics.
double DataLaw::area(std::size_t k, double a, double b) const {
  double fa[5], fm[5], fb[5];
  curve_.calc_interval(k, a, fa);
  curve_.calc_interval(k, 0.5 * (a + b), fm);
  curve_.calc_interval(k, b, fb);
  return (b - a) / 6 * (fa[0] + 4 * fm[0] + fb[0]);
}

double DataLaw::area_to(double x) const {
  double f[5], sum = 0;
  const std::vector<double>& at = curve_.x();
  if (beyond_ == Beyond::repeat && (x < at.front() || x > at.back())) {
    const double n = lengths(x);
    return n * area_to(at.back()) + area_to(std::clamp(x - n * length(), at.front(), at.back()));
  }
  for (std::size_t k = 0; k + 1 < at.size() && at[k] < x; ++k) sum += area(k, at[k], std::min(x, at[k + 1]));
  if (x >= at.front() && x <= at.back()) return sum;
  const double end = x < at.front() ? at.front() : at.back();
  calc_derivatives(x, f);
  const double far = f[0];
  calc_derivatives(end, f);
  return sum + 0.5 * (far + f[0]) * (x - end);
}

double DataLaw::integral(double x, const double* p) const {
  const bool reaches = beyond_ != Beyond::refuse || (curve_.x().front() <= 0 && 0 <= curve_.x().back());
  return p[0] * (area_to(x) - (reaches ? area_to(0) : 0));
}

}  // namespace costate
