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

void require_rising(const std::vector<double>& breaks) {
  for (std::size_t k = 1; k < breaks.size(); ++k)
    if (!(breaks[k] > breaks[k - 1]))
      throw ModelError(
          "", fmt::format("'breaks' must increase: entry {} is {} after {}.", k + 1, breaks[k], breaks[k - 1]));
}

LawOptions law_of(const std::vector<double>& breaks, const std::vector<std::vector<double>>& coefficients,
                  bool continued) {
  std::vector<std::size_t> sizes;
  for (const auto& c : coefficients) sizes.push_back(c.size());
  LawOptions o;
  o.law = std::make_shared<PiecewiseLaw>(static_cast<int>(breaks.size()), sizes, continued);
  require_rising(breaks);
  for (std::size_t k = 0; k < coefficients.size(); ++k)
    for (std::size_t i = 0; i < coefficients[k].size(); ++i)
      o.numbers.emplace_back(fmt::format("coefficients[{}][{}]", k, i), coefficients[k][i]);
  for (std::size_t k = 0; k < breaks.size(); ++k) o.numbers.emplace_back(fmt::format("breaks[{}]", k), breaks[k]);
  return o;
}

// What agrees to 1e-9 of its size is meant to be equal.
bool unlike(double left, double right) {
  return std::abs(right - left) > 1e-9 * std::max(std::abs(left), std::abs(right));
}
}  // namespace

PiecewiseLaw::PiecewiseLaw(int breaks, const std::vector<std::size_t>& sizes, bool continued)
    : breaks_(breaks), continued_(continued), offsets_{0} {
  if (breaks_ < 1) throw ModelError("", "'breaks' is empty; a law of one piece is a polynomial.");
  if (sizes.size() != static_cast<std::size_t>(breaks_) + 1)
    throw ModelError("",
                     fmt::format("'coefficients' must hold one polynomial an interval, {} for {} break{}; found {}.",
                                 breaks_ + 1, breaks_, breaks_ == 1 ? "" : "s", sizes.size()));
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    if (sizes[k] == 0)
      throw ModelError("", fmt::format("'coefficients[{}]' is empty; a piece without {} is [0].", k,
                                       continued && k > 0 ? "slope" : "force"));
    offsets_.push_back(offsets_.back() + static_cast<int>(sizes[k]));
  }
}

void PiecewiseLaw::add_kinks(const double* p, std::vector<double>& x) const {
  for (int k = 0; k < breaks_; ++k) {
    const double at = first_break(p)[k];
    const auto slope = [&](int piece) { return value_of_piece<Dual<1>>(piece, Dual<1>::variable(at, 0), p).d[0]; };
    if (unlike(slope(k), slope(k + 1))) x.push_back(at);
  }
}

void PiecewiseLaw::add_curvature_jumps(const double* p, std::vector<double>& x) const {
  for (int k = 0; k < breaks_; ++k) {
    const double at = first_break(p)[k];
    const auto curve = [&](int piece) { return value_of_piece<Taylor2>(piece, Taylor2(at, 1, 0), p); };
    const Taylor2 left = curve(k), right = curve(k + 1);
    if (!unlike(left.c1, right.c1) && unlike(left.c2, right.c2)) x.push_back(at);
  }
}

// What a moved break does to the second derivative, by either side of it.
void PiecewiseLaw::add_third_jumps(const double* p, std::vector<double>& x) const {
  for (int k = 0; k < breaks_; ++k) {
    const double at = first_break(p)[k];
    const auto curve = [&](int piece) {
      return value_of_piece<Dual<1, Taylor2>>(piece, Dual<1, Taylor2>::variable(Taylor2(at, 1, 0), 0), p);
    };
    const Dual<1, Taylor2> left = curve(k), right = curve(k + 1);
    if (!unlike(left.v.c1, right.v.c1) && !unlike(left.v.c2, right.v.c2) && unlike(left.d[0].c2, right.d[0].c2))
      x.push_back(at);
  }
}

void PiecewiseLaw::add_place_slopes(double x, const double* p, double* slopes) const {
  for (int k = 0; k < breaks_; ++k)
    if (first_break(p)[k] == x) slopes[offsets_.back() + k] += 1;
}

void PiecewiseLaw::add_places(const double* p, LawPlaces& places) const {
  const std::vector<double> breaks(first_break(p), first_break(p) + breaks_);
  require_rising(breaks);
  places.sharp.insert(places.sharp.end(), breaks.begin(), breaks.end());
}

double PiecewiseLaw::integral_of_piece(int piece, double from, double to, const double* p) const {
  const bool local = continued_ && piece > 0;
  const double shift = local ? first_break(p)[piece - 1] : 0, begin = local ? value_of_piece(piece, shift, p) : 0;
  const int first = offsets_[static_cast<std::size_t>(piece)],
            count = offsets_[static_cast<std::size_t>(piece) + 1] - first;
  const auto primitive = [&](double x) {
    double sum = 0;
    for (int n = count; n > 0; --n) sum = (sum + p[first + n - 1] / (local ? n + 1 : n)) * x;
    return local ? (sum + begin) * x : sum;
  };
  return primitive(to - shift) - primitive(from - shift);
}

double PiecewiseLaw::integral(double x, const double* p) const {
  const double low = std::min(x, 0.0), high = std::max(x, 0.0);
  double sum = 0, from = low;
  for (int k = piece(low, p); from < high; ++k) {
    const double to = k < breaks_ ? std::min(high, first_break(p)[k]) : high;
    sum += integral_of_piece(k, from, to, p);
    from = to;
  }
  return x < 0 ? -sum : sum;
}

LawOptions piecewise_law(const std::vector<double>& breaks, const std::vector<std::vector<double>>& coefficients,
                         Joins joins) {
  LawOptions o = law_of(breaks, coefficients, false);
  check_joins(breaks, coefficients, joins);
  return o;
}

LawOptions continued_law(const std::vector<double>& breaks, const std::vector<std::vector<double>>& coefficients) {
  return law_of(breaks, coefficients, true);
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
       const std::string joins = t.one_of("joins", {"none", "value", "slope", "continued"}, "value");
       if (joins == "continued") return continued_law(breaks, coefficients);
       return piecewise_law(breaks, coefficients,
                            joins == "slope"   ? Joins::slope
                            : joins == "value" ? Joins::value
                                               : Joins::none);
     }});

}  // namespace

}  // namespace costate
