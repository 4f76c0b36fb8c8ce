#include "costate/element/law/road_laws.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "costate/base/error.h"
#include "costate/element/course.h"

namespace costate {

namespace {
constexpr int kLanes = 4;  // sines that are rotated side by side: independent chains, which the processor overlaps
}

BumpLaw::Place BumpLaw::place(double y, double length, double spacing) const {
  if (!(y >= 0)) return {0, false};
  if (count_ == 1) return {0, y < length};
  // Neighbours that touch leave no gap between them, whatever the rounding.
  const bool touching = spacing - length < 1e-12 * spacing;
  int k = std::clamp(static_cast<int>(std::min(y / spacing, 1.0 * count_)), 0, count_ - 1);
  if (k > 0 && y - k * spacing < 0) --k;
  return {k, (touching && k + 1 < count_) || y - k * spacing < length};
}

void BumpLaw::add_ends(const double* p, std::vector<double>& x) const {
  // Where the law enters another of its pieces: the first x of the next one in floating point.
  const double spacing = count_ > 1 ? p[3] : 0;
  const auto same = [&](double a, double b) {
    const Place i = place(a - p[1], p[2], spacing), j = place(b - p[1], p[2], spacing);
    return i.bump == j.bump && i.on == j.on;
  };
  const auto add = [&](double at) {
    const double width = 1e-12 * (std::abs(at) + std::abs(p[1]) + p[2] + count_ * spacing);
    double before = at - width, after = at + width;
    if (same(before, after)) return;
    for (double middle; middle = before + (after - before) / 2, before < middle && middle < after;)
      (same(before, middle) ? before : after) = middle;
    x.push_back(after);
  };
  for (int k = 0; k < count_; ++k) {
    const double start = p[1] + k * spacing;
    add(start);
    if (k + 1 == count_ || spacing - p[2] > 1e-9 * spacing) add(start + p[2]);
  }
}

// start + k spacing, and length behind it. Bumps that touch meet in one place, which a change of the length or of the
// spacing splits into two.
void BumpLaw::add_place_slopes(double x, const double* p, double* slopes) const {
  const double spacing = count_ > 1 ? p[3] : 0;
  int bump = 0;
  bool end = false;
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < count_; ++k)
    for (const bool behind : {false, true}) {
      const double off = std::abs(x - (p[1] + k * spacing + (behind ? p[2] : 0)));
      if (off >= nearest) continue;
      nearest = off;
      bump = k;
      end = behind;
    }
  slopes[1] += 1;
  const bool touching = count_ > 1 && spacing - p[2] <= 1e-9 * spacing;
  const bool inner = touching && !(bump == 0 && !end) && !(bump + 1 == count_ && end);
  if (inner) {
    slopes[2] = slopes[3] = std::nan("");
    return;
  }
  if (end) slopes[2] += 1;
  if (count_ > 1) slopes[3] += bump;
}

void BumpLaw::add_places(const double* p, LawPlaces& places) const { add_ends(p, places.sharp); }

void SineSweepLaw::add_place_slopes(double x, const double* p, double* slopes) const {
  slopes[1] += 1;
  if (std::abs(x - p[1] - p[2]) < std::abs(x - p[1])) slopes[2] += 1;
}

void SineSweepLaw::add_places(const double* p, LawPlaces& places) const {
  constexpr int pieces = 16;
  places.sharp.push_back(p[1]);
  const double h = p[2] / pieces;
  const auto add = [&](double from, double to, double wave_number) {
    if (wave_number > 0 && from < to) places.waves.push_back({from, to, 1 / wave_number});
  };
  const auto number = [&](double y) { return std::abs(p[3] + (p[4] - p[3]) * y / p[2]); };
  for (int k = 0; k < pieces; ++k) add(p[1] + k * h, p[1] + (k + 1) * h, std::max(number(k * h), number((k + 1) * h)));
  add(p[1] + p[2], places.to, std::abs(p[4]));
}

void SineSumLaw::add_places(const double* p, LawPlaces& places) const {
  // The mean wave number, by slopes: sines as short as this make up for most of the change.
  double heights = 0, slopes = 0;
  for (int i = 0; i < options_.count; ++i) {
    const double a = unit_amplitude(i), n = wave_number(i);
    heights += a * a;
    slopes += a * a * n * n;
  }
  if (p[0] > 0 && slopes > 0) places.waves.push_back({places.from, places.to, std::sqrt(heights / slopes)});
}

void ProfileTableLaw::add_places(const double*, LawPlaces& places) const {
  places.knots.insert(places.knots.end(), curve_.x().begin(), curve_.x().end());
}

SineSumLaw::SineSumLaw(const SpectrumOptions& o) : options_(o) {
  if (o.count < 1) throw ModelError("", fmt::format("'count' must be at least 1, found {}.", o.count));
  if (!(o.n_min > 0)) throw ModelError("", fmt::format("'n_min_1_per_m' must be positive, found {}.", o.n_min));
  if (!(o.n_max > o.n_min))
    throw ModelError(
        "", fmt::format("'n_max_1_per_m' must be greater than 'n_min_1_per_m', found {} and {}.", o.n_max, o.n_min));
  spacing_ = (o.n_max - o.n_min) / o.count;
  std::mt19937 engine(o.seed);
  const std::size_t padded = static_cast<std::size_t>((o.count + kLanes - 1) / kLanes * kLanes);
  sine_.assign(padded, 0.0);
  cosine_.assign(padded, 0.0);
  frequency_.assign(padded, 0.0);
  for (int i = 0; i < o.count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    amplitude_.push_back(std::sqrt(2 * spacing_) * std::pow(wave_number(i) / 0.1, -o.exponent / 2));
    phase_.push_back(kTwoPi * (engine() / 4294967296.0));
    sine_[k] = amplitude_[k] * std::cos(phase_[k]);
    cosine_[k] = amplitude_[k] * std::sin(phase_[k]);
    frequency_[k] = kTwoPi * wave_number(i);
  }
}

namespace {
using Lanes = std::array<double, kLanes>;

/// The sums of order 0, of 0 to 2 or of all five, so that the inner loops have no branches and vectorize.
template <int Most>
void accumulate(std::size_t n, const double* a, const double* b, const double* w, double turn_c, double turn_s, Lanes c,
                Lanes s, double* f) {
  Lanes sum[5] = {};
  for (std::size_t i = 0; i < n; i += kLanes, a += kLanes, b += kLanes, w += kLanes) {
    Lanes y, yd, w2;
    for (int l = 0; l < kLanes; ++l) y[l] = a[l] * s[l] + b[l] * c[l];
    for (int l = 0; l < kLanes; ++l) sum[0][l] += y[l];
    if constexpr (Most > 0) {
      for (int l = 0; l < kLanes; ++l) yd[l] = w[l] * (a[l] * c[l] - b[l] * s[l]);
      for (int l = 0; l < kLanes; ++l) w2[l] = w[l] * w[l];
      for (int l = 0; l < kLanes; ++l) sum[1][l] += yd[l];
      for (int l = 0; l < kLanes; ++l) sum[2][l] -= w2[l] * y[l];
    }
    if constexpr (Most > 2) {
      for (int l = 0; l < kLanes; ++l) sum[3][l] -= w2[l] * yd[l];
      for (int l = 0; l < kLanes; ++l) sum[4][l] += w2[l] * w2[l] * y[l];
    }
    Lanes next;
    for (int l = 0; l < kLanes; ++l) next[l] = c[l] * turn_c - s[l] * turn_s;
    for (int l = 0; l < kLanes; ++l) s[l] = s[l] * turn_c + c[l] * turn_s;
    c = next;
  }
  for (int k = 0; k < 5; ++k) {
    f[k] = 0;
    for (int l = 0; l < kLanes; ++l) f[k] += sum[k][l];
  }
}
}  // namespace

void SineSumLaw::calc_sums(double x, int order, double* f) const {
  const double step = kTwoPi * spacing_ * x, turn_c = std::cos(kLanes * step), turn_s = std::sin(kLanes * step);
  Lanes c, s;
  for (int l = 0; l < kLanes; ++l) {
    const double angle = kTwoPi * wave_number(l) * x;
    c[l] = std::cos(angle);
    s[l] = std::sin(angle);
  }
  const auto add = order == 0 ? accumulate<0> : order <= 2 ? accumulate<2> : accumulate<4>;
  add(sine_.size(), sine_.data(), cosine_.data(), frequency_.data(), turn_c, turn_s, c, s, f);
}

ProfileTableLaw::ProfileTableLaw(std::vector<double> x, std::vector<double> y) {
  const std::size_t n = x.size();
  if (n != y.size()) throw ModelError("", fmt::format("The table has {} distances but {} heights.", n, y.size()));
  if (n < 2) throw ModelError("", fmt::format("A table needs at least 2 points, found {}.", n));
  for (std::size_t i = 1; i < n; ++i)
    if (!(x[i] > x[i - 1]))
      throw ModelError("", fmt::format("The distances must increase: entry {} is {} after {}.", i + 1, x[i], x[i - 1]));
  curve_ = PointCurve(std::move(x), std::move(y), PointCurve::Between::spline);
}

}  // namespace costate
