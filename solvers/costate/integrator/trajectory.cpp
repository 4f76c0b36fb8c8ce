#include "costate/integrator/trajectory.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace costate {

void Trajectory::add_step(double begin, double end, const std::vector<std::vector<double>>& d, int order) {
  steps_.push_back({begin, end, order, coefficients_.size()});
  double factorial = 1;
  for (int k = 0; k <= order; ++k) {
    if (k > 1) factorial *= k;
    for (int i = 0; i < width_; ++i)
      coefficients_.push_back(d[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)] / factorial);
  }
}

namespace {

constexpr int kMoreOrders = 2;
// Where the motion bends more than the integrator's unknowns do (a body that turns evenly has an angle which is a
// straight line, and steps of many turns) the order is raised, then the step halved, until what an interpolation leaves
// out is this small relative to the coordinate, or to the largest one.
constexpr double kLeftOut = 1e-12, kLeftOutOfLargest = 1e-14;
constexpr int kHighest = 10;  // powers of a higher degree cancel
constexpr int kHalvings = 20;
constexpr double kGetsOn = 0.75;  // of what is left out; halving noise, or a jump, would not help

/// (q, v, z) on [begin, end]: coefficients of Chebyshev's polynomials up to degree p, in x = 1 + 2 (t - end) / h.
struct Piece {
  double begin, end;
  int p;
  std::vector<double> coefficients;
  double left_out = 0;  // in the bounds above
};

Piece interpolate(double begin, double end, int p, int n, int nz, const std::function<StateView(double t)>& motion) {
  const double h = end - begin, pi = std::acos(-1.0);
  const auto width = static_cast<std::size_t>(2 * n + nz), degrees = static_cast<std::size_t>(p) + 1;
  Piece piece{begin, end, p, std::vector<double>(degrees * width, 0)};
  std::vector<double>& c = piece.coefficients;
  // From the values at x = cos(pi i / p).
  for (int i = 0; i <= p; ++i) {
    const StateView s = motion(i == 0 ? end : i == p ? begin : end + h * 0.5 * (std::cos(pi * i / p) - 1));
    for (int k = 0; k <= p; ++k) {
      const double weight =
          (i == 0 || i == p ? 0.5 : 1.0) * (k == 0 || k == p ? 1.0 : 2.0) / p * std::cos(pi * ((i * k) % (2 * p)) / p);
      double* out = c.data() + static_cast<std::size_t>(k) * width;
      for (int j = 0; j < n; ++j) {
        out[j] += weight * s.q[j];
        out[n + j] += weight * s.v[j];
      }
      for (int j = 0; j < nz; ++j) out[2 * n + j] += weight * s.z[j];
    }
  }
  std::vector<double> size(width, 0);
  for (std::size_t k = 0; k < degrees; ++k)
    for (std::size_t j = 0; j < width; ++j) size[j] += std::abs(c[k * width + j]);
  const double largest = width > 0 ? *std::max_element(size.begin(), size.end()) : 0;
  for (std::size_t j = 0; j < width && largest > 0; ++j) {
    // They fall by about a factor a degree; one of them may vanish by symmetry.
    const double last = std::abs(c[(degrees - 1) * width + j]), before = std::abs(c[(degrees - 2) * width + j]);
    piece.left_out =
        std::max(piece.left_out, std::max(last, 0.1 * before) / (kLeftOut * size[j] + kLeftOutOfLargest * largest));
  }
  return piece;
}

void fit(double begin, double end, int p, int n, int nz, const std::function<StateView(double t)>& motion, int halvings,
         double before, std::vector<Piece>& pieces) {
  Piece piece = interpolate(begin, end, p, n, nz, motion);
  if (piece.left_out > 1 && p < kHighest) piece = interpolate(begin, end, p = kHighest, n, nz, motion);
  const double middle = begin + 0.5 * (end - begin), left_out = piece.left_out;
  if (!(left_out > 1) || halvings == 0 || left_out > kGetsOn * before || !(begin < middle && middle < end)) {
    pieces.push_back(std::move(piece));
    return;
  }
  fit(begin, middle, p, n, nz, motion, halvings - 1, left_out, pieces);
  fit(middle, end, p, n, nz, motion, halvings - 1, left_out, pieces);
}

}  // namespace

void Trajectory::add_step(double begin, double end, int order, const std::function<StateView(double t)>& motion) {
  std::vector<Piece> pieces;
  fit(begin, end, order + kMoreOrders, n_, nz_, motion, kHalvings, std::numeric_limits<double>::infinity(), pieces);
  for (const Piece& piece : pieces) {
    const double h = piece.end - piece.begin;
    const auto width = static_cast<std::size_t>(width_), degrees = static_cast<std::size_t>(piece.p) + 1;
    const std::vector<double>& chebyshev = piece.coefficients;
    // T_(k+1) = 2 x T_k - T_(k-1) in powers of (t - end) / h, then of t - end.
    const std::size_t first = coefficients_.size();
    steps_.push_back({piece.begin, piece.end, piece.p, first});
    coefficients_.resize(first + degrees * width, 0);
    std::vector<double> last(degrees, 0), now(degrees, 0), next(degrees, 0);
    now[0] = 1;
    for (std::size_t k = 0; k < degrees; ++k) {
      double power = 1;
      for (std::size_t l = 0; l <= k; ++l, power /= h)
        for (std::size_t j = 0; j < width; ++j)
          coefficients_[first + l * width + j] += now[l] * power * chebyshev[k * width + j];
      const double twice = k == 0 ? 1 : 2;  // T_1 = x
      for (std::size_t l = 0; l < degrees; ++l) next[l] = twice * (now[l] + (l > 0 ? 2 * now[l - 1] : 0)) - last[l];
      last = now;
      now = next;
    }
  }
}

void Trajectory::evaluate(double t, double* y) const {
  auto at = std::lower_bound(steps_.begin(), steps_.end(), t, [](const Step& s, double x) { return s.end < x; });
  if (at == steps_.end()) --at;
  const double s = std::max(t, steps_.front().begin) - at->end;
  const auto width = static_cast<std::size_t>(width_);
  const double* c = coefficients_.data() + at->first + static_cast<std::size_t>(at->order) * width;
  std::copy(c, c + width, y);
  for (int k = at->order - 1; k >= 0; --k) {
    c -= width;
    for (std::size_t i = 0; i < width; ++i) y[i] = y[i] * s + c[i];
  }
}

}  // namespace costate
