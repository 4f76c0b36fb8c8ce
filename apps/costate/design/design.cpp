#include "design.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <random>

#include "costate/base/error.h"

namespace costate::app {

namespace {

using Points = std::vector<std::vector<double>>;

/// Uniform in (0, 1), the same on every machine (the standard's distributions are not).
class Uniform {
 public:
  explicit Uniform(unsigned long seed) : random_(seed) {}
  double operator()() { return (static_cast<double>(random_() >> 11) + 0.5) * std::exp2(-53); }

 private:
  std::mt19937_64 random_;
};

/// A primitive polynomial (its degree, its inner coefficients) and the first direction numbers, as Joe and Kuo choose
/// them (ACM Transactions on Mathematical Software 29, 2003), of the second dimension onwards.
struct Direction {
  unsigned degree, inner;
  std::array<std::uint32_t, 5> first;
};
constexpr std::array<Direction, 12> kDirections = {{{1, 0, {1}},
                                                    {2, 1, {1, 3}},
                                                    {3, 1, {1, 3, 1}},
                                                    {3, 2, {1, 1, 1}},
                                                    {4, 1, {1, 1, 3, 3}},
                                                    {4, 4, {1, 3, 5, 13}},
                                                    {5, 2, {1, 1, 5, 5, 17}},
                                                    {5, 4, {1, 1, 5, 5, 5}},
                                                    {5, 7, {1, 1, 7, 11, 19}},
                                                    {5, 11, {1, 1, 5, 1, 1}},
                                                    {5, 13, {1, 1, 1, 3, 11}},
                                                    {5, 14, {1, 3, 5, 5, 31}}}};
constexpr unsigned kBits = 31;

std::array<std::uint32_t, kBits> directions(std::size_t dimension) {
  std::array<std::uint32_t, kBits> v{};
  if (dimension == 0) {
    for (unsigned k = 0; k < kBits; ++k) v[k] = 1U << (kBits - 1 - k);
    return v;
  }
  const Direction& d = kDirections[dimension - 1];
  for (unsigned k = 0; k < kBits; ++k) {
    if (k < d.degree) {
      v[k] = d.first[k] << (kBits - 1 - k);
      continue;
    }
    v[k] = v[k - d.degree] ^ (v[k - d.degree] >> d.degree);
    for (unsigned j = 1; j < d.degree; ++j)
      if ((d.inner >> (d.degree - 1 - j) & 1U) != 0) v[k] ^= v[k - j];
  }
  return v;
}

/// In Gray code's order, without the first point, which is the corner.
Points sobol(std::size_t dimensions, int count) {
  if (dimensions > kDirections.size() + 1)
    throw Error(fmt::format("A Sobol sequence here has at most {} dimensions, found {} numbers; take latin-hypercube.",
                            kDirections.size() + 1, dimensions));
  Points points(static_cast<std::size_t>(count), std::vector<double>(dimensions));
  for (std::size_t d = 0; d < dimensions; ++d) {
    const auto v = directions(d);
    std::uint32_t x = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      unsigned bit = 0;
      while ((i >> bit & 1U) != 0) ++bit;
      x ^= v[bit];
      points[i][d] = static_cast<double>(x) * std::exp2(-static_cast<double>(kBits));
    }
  }
  return points;
}

Points latin_hypercube(std::size_t dimensions, int count, Uniform& uniform) {
  Points points(static_cast<std::size_t>(count), std::vector<double>(dimensions));
  for (std::size_t d = 0; d < dimensions; ++d) {
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    for (std::size_t i = order.size(); i > 1; --i)
      std::swap(order[i - 1], order[static_cast<std::size_t>(uniform() * static_cast<double>(i))]);
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i][d] = (static_cast<double>(order[i]) + uniform()) / static_cast<double>(count);
  }
  return points;
}

/// From rows that hold A and B side by side.
Points saltelli(const Points& pairs, std::size_t n) {
  Points points;
  for (const auto& both : pairs) {
    const auto middle = both.begin() + static_cast<std::ptrdiff_t>(n);
    const std::vector<double> a(both.begin(), middle), b(middle, both.end());
    points.push_back(a);
    points.push_back(b);
    for (std::size_t i = 0; i < n; ++i) {
      points.push_back(a);
      points.back()[i] = b[i];
    }
  }
  return points;
}

Points monte_carlo(std::size_t dimensions, int count, Uniform& uniform) {
  Points points(static_cast<std::size_t>(count), std::vector<double>(dimensions));
  for (auto& p : points)
    for (double& x : p) x = uniform();
  return points;
}

Points grid(const std::vector<Variation>& variations) {
  Points points = {{}};
  for (const Variation& v : variations) {
    Points longer;
    for (const auto& p : points)
      for (int k = 0; k < v.steps; ++k) {
        longer.push_back(p);
        longer.back().push_back(v.steps == 1 ? 0.5 : static_cast<double>(k) / (v.steps - 1));
      }
    points = std::move(longer);
  }
  return points;
}

}  // namespace

double normal_quantile(double u) {
  // Of the tail's series a first guess, then Newton's method (with the second derivative) on the distribution itself.
  const double p = std::min(u, 1 - u), t = std::sqrt(-2 * std::log(p));
  double x = -(t - (2.515517 + t * (0.802853 + t * 0.010328)) / (1 + t * (1.432788 + t * (0.189269 + t * 0.001308))));
  for (int k = 0; k < 4; ++k) {
    const double error = 0.5 * std::erfc(-x / std::numbers::sqrt2) - p;
    const double step = error * std::sqrt(2 * std::numbers::pi) * std::exp(0.5 * x * x);
    x -= step / (1 + 0.5 * x * step);
  }
  return u < 0.5 ? x : -x;
}

double Variation::value(double u) const {
  if (kind == Kind::normal) return first + second * normal_quantile(u);
  if (u == 1) return second;
  if (kind == Kind::logarithmic) return first * std::pow(second / first, u);
  return first + u * (second - first);
}

double Variation::slope_factor(double x) const {
  if (kind == Kind::normal) return second;
  return (kind == Kind::logarithmic ? x * std::log(second / first) : second - first) / std::numbers::pi;
}

const std::vector<std::string>& design_kinds() {
  static const std::vector<std::string> kinds = {"grid", "latin-hypercube", "sobol", "monte-carlo", "saltelli"};
  return kinds;
}

bool draws_points(const std::string& kind, std::size_t numbers) {
  if (kind == "saltelli") return 2 * numbers > kDirections.size() + 1;
  return kind != "grid" && kind != "sobol";
}

std::vector<std::vector<double>> design_points(const std::string& kind, const std::vector<Variation>& variations,
                                               int count, unsigned long seed) {
  const std::size_t n = variations.size();
  Uniform uniform(seed);
  Points points;
  if (kind == "grid") {
    points = grid(variations);
  } else if (kind == "sobol") {
    points = sobol(n, count);
  } else if (kind == "latin-hypercube") {
    points = latin_hypercube(n, count, uniform);
  } else if (kind == "saltelli") {
    if (draws_points(kind, n)) {
      points = saltelli(monte_carlo(2 * n, count, uniform), n);
    } else {
      // In a sequence's first point all numbers are in the middle: A and B are one there, and tell nothing.
      Points pairs = sobol(2 * n, count + 1);
      pairs.erase(pairs.begin());
      points = saltelli(pairs, n);
    }
  } else {
    points = monte_carlo(n, count, uniform);
  }
  for (auto& p : points)
    for (std::size_t k = 0; k < n; ++k) p[k] = variations[k].value(p[k]);
  return points;
}

}  // namespace costate::app
