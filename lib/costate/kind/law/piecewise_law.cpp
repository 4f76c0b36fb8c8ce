#include "costate/kind/law/piecewise_law.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/element/course.h"
#include "costate/kind/law/law_table.h"

namespace costate {

namespace {
constexpr double kJoin = 1e-3;

struct PieceEnd {
  double value = 0, slope = 0, value_size = 0, slope_size = 0;  // size: sum of the terms' magnitudes
};

PieceEnd evaluate_terms(const std::vector<double>& c, double x) {
  PieceEnd e;
  double power = 1;  // x^i
  for (std::size_t i = 0; i < c.size(); ++i) {
    e.value += c[i] * power;
    e.value_size += std::abs(c[i] * power);
    if (i + 1 < c.size()) {
      const double term = static_cast<double>(i + 1) * c[i + 1] * power;
      e.slope += term;
      e.slope_size += std::abs(term);
    }
    power *= x;
  }
  return e;
}

void check_joins(const std::vector<double>& breaks, const std::vector<std::vector<double>>& c, Joins joins) {
  double value_size = 0, slope_size = 0;
  for (std::size_t k = 0; k < breaks.size(); ++k)
    for (const auto& piece : {c[k], c[k + 1]}) {
      const PieceEnd e = evaluate_terms(piece, breaks[k]);
      value_size = std::max(value_size, e.value_size);
      slope_size = std::max(slope_size, e.slope_size);
    }
  for (std::size_t k = 0; k < breaks.size(); ++k) {
    const PieceEnd left = evaluate_terms(c[k], breaks[k]), right = evaluate_terms(c[k + 1], breaks[k]);
    const auto refuse = [&](const char* what, double a, double b, const char* allow) {
      throw ModelError(
          "",
          fmt::format("The pieces do not meet at the break x = {:g}: the {} is {:.9g} on its left and "
                      "{:.9g} on its right. Correct the coefficients, or allow it with joins = \"{}\"{}.",
                      breaks[k], what, a, b, allow, *allow == 'n' ? "; a law that jumps has no exact gradients" : ""));
    };
    if (joins != Joins::none && std::abs(left.value - right.value) > kJoin * value_size)
      refuse("value", left.value, right.value, "none");
    if (joins == Joins::slope && std::abs(left.slope - right.slope) > kJoin * slope_size)
      refuse("slope", left.slope, right.slope, "value");
  }
}
}  // namespace

PiecewiseLaw::PiecewiseLaw(std::vector<double> breaks, const std::vector<std::size_t>& sizes)
    : breaks_(std::move(breaks)), offsets_{0} {
  if (breaks_.empty()) throw ModelError("", "'breaks' is empty; a law of one piece is a polynomial.");
  for (std::size_t k = 1; k < breaks_.size(); ++k)
    if (!(breaks_[k] > breaks_[k - 1]))
      throw ModelError(
          "", fmt::format("'breaks' must increase: entry {} is {} after {}.", k + 1, breaks_[k], breaks_[k - 1]));
  if (sizes.size() != breaks_.size() + 1)
    throw ModelError("",
                     fmt::format("'coefficients' must hold one polynomial an interval, {} for {} break{}; found {}.",
                                 breaks_.size() + 1, breaks_.size(), breaks_.size() == 1 ? "" : "s", sizes.size()));
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    if (sizes[k] == 0)
      throw ModelError("", fmt::format("'coefficients[{}]' is empty; a piece without force is [0].", k));
    offsets_.push_back(offsets_.back() + static_cast<int>(sizes[k]));
  }
}

double PiecewiseLaw::primitive(int piece, double x, const double* p) const {
  double sum = 0;
  for (int n = offsets_[piece + 1] - offsets_[piece]; n > 0; --n) sum = (sum + p[offsets_[piece] + n - 1] / n) * x;
  return sum;
}

void PiecewiseLaw::add_kinks(const double* p, std::vector<double>& x) const {
  for (int k = 0; k < static_cast<int>(breaks_.size()); ++k) {
    const auto slope = [&](int piece) { return polynomial<Dual<1>>(piece, Dual<1>::variable(breaks_[k], 0), p).d[0]; };
    // Slopes that agree to 1e-9 of their size are meant to be equal.
    const double left = slope(k), right = slope(k + 1);
    if (std::abs(right - left) > 1e-9 * std::max(std::abs(left), std::abs(right))) x.push_back(breaks_[k]);
  }
}

void PiecewiseLaw::add_places(const double*, LawPlaces& places) const {
  places.sharp.insert(places.sharp.end(), breaks_.begin(), breaks_.end());
}

double PiecewiseLaw::integral(double x, const double* p) const {
  const int start = piece(0), end = piece(x);
  double sum = primitive(end, x, p);  // that of the first piece is 0 at 0
  for (int k = start; k < end; ++k) sum += primitive(k, breaks_[k], p) - primitive(k + 1, breaks_[k], p);
  for (int k = end; k < start; ++k) sum += primitive(k + 1, breaks_[k], p) - primitive(k, breaks_[k], p);
  return sum;
}

LawOptions piecewise_law(const std::vector<double>& breaks, const std::vector<std::vector<double>>& coefficients,
                         Joins joins) {
  std::vector<std::size_t> sizes;
  for (const auto& c : coefficients) sizes.push_back(c.size());
  LawOptions o;
  o.law = std::make_shared<PiecewiseLaw>(breaks, sizes);
  check_joins(breaks, coefficients, joins);
  for (std::size_t k = 0; k < coefficients.size(); ++k)
    for (std::size_t i = 0; i < coefficients[k].size(); ++i)
      o.numbers.emplace_back(fmt::format("coefficients[{}][{}]", k, i), coefficients[k][i]);
  return o;
}

namespace {

const RegisterLawKind piecewise_law_registered(
    {.name = "piecewise",
     .summary = "polynomials on intervals: 'breaks' and one row of 'coefficients' an interval",
     .example = R"({ kind = "piecewise", breaks = [-0.2, 0.21], coefficients = [[-416.42, 1844.3],
       [0, 9945.627, 33955.72, -59832.25, -395651], [1919.1638, 1634.727]], joins = "slope" })",
     .read = [](SceneTable& t) {
       const auto breaks = t.values("breaks");
       const auto coefficients = t.value_rows("coefficients");
       const std::string joins = t.one_of("joins", {"none", "value", "slope"}, "value");
       return piecewise_law(breaks, coefficients,
                            joins == "slope"   ? Joins::slope
                            : joins == "value" ? Joins::value
                                               : Joins::none);
     }});

}  // namespace

}  // namespace costate
