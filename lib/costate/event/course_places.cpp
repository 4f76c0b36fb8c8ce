#include "costate/event/course_places.h"

#include <algorithm>
#include <cmath>

#include "costate/base/golden_section.h"

namespace costate {

namespace {
// Places beyond the step's ends count as well, so far; and of what comes back those that it nearly reaches.
constexpr double kBeyond = 0.1, kNearly = 0.05;
constexpr int kPlacing = 40, kTurning = 32;
// Of the largest value nearby: a value is rounding.
constexpr double kPassed = 1e-15;
}  // namespace

void CoursePlaces::find(const std::vector<double>& u, const std::vector<double>& course,
                        const std::vector<double>& knots, const std::function<double(double)>& at,
                        std::vector<double>& places) {
  const auto [least, most] = std::minmax_element(course.begin(), course.end());
  const double range = *most - *least;
  if (!(range > 1e-13 * std::max(std::abs(*least), std::abs(*most)))) return;
  CoursePlaces search(knots, at, places);
  const std::size_t last = u.size() - 1;
  for (std::size_t k = 0; k < last; ++k) search.add_passages({u[k], course[k]}, {u[k + 1], course[k + 1]});
  for (const std::size_t k : {std::size_t{0}, last - 1}) {
    const double slope = (course[k + 1] - course[k]) / (u[k + 1] - u[k]);
    const double from = k == 0 ? 0 : 1, x = k == 0 ? course[0] : course[last];
    if (slope != 0)
      search.each_between(x, x + (k == 0 ? -1 : 1) * kBeyond * slope,
                          [&](double knot) { search.put(from + (knot - x) / slope); });
  }
  for (std::size_t k = 1; k < last; ++k) {
    const double left = course[k] - course[k - 1], right = course[k + 1] - course[k];
    const double a = u[k] - u[k - 1], b = u[k + 1] - u[k], sl = left / a, sr = right / b;
    const double curvature = (sr - sl) / (a + b), slope = (sl * b + sr * a) / (a + b);
    if (curvature == 0) continue;
    const double turn = -0.5 * slope / curvature;
    const Look top{u[k] + turn, course[k] + 0.5 * slope * turn};
    const auto look = [&](std::size_t i) { return Look{u[i], course[i]}; };
    const auto between = [&](std::size_t i, std::size_t j) {
      const auto [low, high] = std::minmax({course[i], course[k], course[j]});
      search.add_turn(look(i), look(j), curvature < 0 ? high : low, top, range);
    };
    // At the step's ends, too, where no look is beyond.
    if (left * right < 0)
      between(k - 1, k + 1);
    else if (k == 1 && top.u > u[0] && top.u < u[1])
      between(0, 1);
    else if (k == last - 1 && top.u > u[k] && top.u < u[last])
      between(k, last);
  }
}

template <class Meet>
void CoursePlaces::each_between(double a, double b, const Meet& meet) const {
  if (a > b) std::swap(a, b);
  for (auto c = std::lower_bound(knots_.begin(), knots_.end(), a); c != knots_.end() && *c <= b; ++c) meet(*c);
}

void CoursePlaces::put(double u) {
  if (u >= -kBeyond && u <= 1 + kBeyond) places_.push_back(u);
}

void CoursePlaces::add_passages(const Look& a, const Look& b) {
  each_between(a.x, b.x, [&](double knot) { put(passage(a, b, knot)); });
}

// By false position, with halves of the side that stays, and by the secant at last.
double CoursePlaces::passage(Look a, Look b, double knot) const {
  a.x -= knot;
  b.x -= knot;
  const double rounding = kPassed * std::max(std::abs(a.x), std::abs(b.x));
  double fa = a.x, fb = b.x;
  for (int k = 0; k < kPlacing && b.u - a.u > kPlaced; ++k) {
    if (std::abs(a.x) <= rounding) return a.u;
    if (std::abs(b.x) <= rounding) return b.u;
    const double u = a.u + std::clamp(fa / (fa - fb), 0.01, 0.99) * (b.u - a.u);
    const Look look{u, at_(u) - knot};
    if ((look.x < 0) == (a.x < 0)) {
      a = look;
      fa = a.x;
      fb *= 0.5;
    } else {
      b = look;
      fb = b.x;
      fa *= 0.5;
    }
  }
  return a.u + (a.x == b.x ? 0.5 : std::clamp(a.x / (a.x - b.x), 0.0, 1.0)) * (b.u - a.u);
}

void CoursePlaces::add_turn(const Look& a, const Look& b, double edge, const Look& turn, double range) {
  const double sign = turn.x > edge ? 1 : -1;
  bool nearly = false;
  each_between(edge, turn.x + sign * kNearly * range, [&](double) { nearly = true; });
  if (!nearly) return;
  // Its top by the golden section.
  const GoldenSection section = golden_section(
      a.u, b.u, kTurning, [&](double u) { return sign * at_(u); },
      [](const GoldenSection& g) { return g.to - g.from > kPlaced; });
  const Look top{section.best(), sign * section.most()};
  put(top.u);
  if (!(sign * (top.x - edge) > 0)) return;
  each_between(edge, top.x, [&](double knot) {
    put(passage(a, top, knot));
    put(passage(top, b, knot));
  });
}

}  // namespace costate
