// Positions between others: the way that drivers move a mechanism between two times, gone in steps that no place
// without positions fits between, and a time within a step, found from both of its ends.
#include <algorithm>
#include <cmath>

#include "costate/level/maggi_positions.h"

namespace costate {

namespace {
constexpr double kShortest = 1e-9;  // of the parts that a way is gone in
constexpr double kBetween = 10;     // sizes of the mechanism that a step may lead over to be interpolated
}  // namespace

bool MaggiPositions::driven() const {
  return std::any_of(assembly_.phi_t.begin(), assembly_.phi_t.end(), [](double x) { return x != 0; });
}

double MaggiPositions::moved_since(const std::vector<double>& q) const {
  double moved = 0;
  for (std::size_t i = 0; i < q_.size(); ++i)
    if (constrained_[i]) moved = std::max(moved, std::abs(q_[i] - q[i]) * measure(i));
  return moved;
}

double MaggiPositions::driven_way(double dt) {
  if (!(std::abs(dt) * largest(last_.v.data()) > kFar * scale_)) return 0;
  StateView s;
  s.t = last_.t;
  s.q = last_.q.data();
  assembly_.calc_constraints(s);
  if (!driven()) return 0;
  if (factored_chart_ != chart_ || !(distance_between(last_.q, factored_at_) <= kNear * scale_)) {
    factored_chart_ = -1;
    if (!chart().factor(assembly_.phi_q.data())) return 0;
    factored_chart_ = chart_;
    factored_at_ = last_.q;
  }
  for (int i = 0; i < m_; ++i) rate_[i] = -assembly_.phi_t[i];
  std::fill(rate_.begin() + m_, rate_.end(), 0.0);
  chart().solve(rate_.data());
  return std::abs(dt) * largest(rate_.data());
}

bool MaggiPositions::solve_between(double t, const double* y) {
  const Last &from = remembered_, &to = last_;
  const double h = to.t - from.t, s = (t - from.t) / h;
  if (!(s > 0 && s < 1) || !from.accelerated || !to.accelerated ||
      !(h * std::max(largest(from.v.data()), largest(to.v.data())) <= kBetween * scale_))
    return false;
  // Hermite's polynomial of fifth degree: q, v, a at both ends.
  const double r = 1 - s, s3 = s * s * s, r3 = r * r * r;
  for (std::size_t i = 0; i < q_.size(); ++i)
    q_[i] = r3 * ((1 + 3 * s + 6 * s * s) * from.q[i] + h * s * ((1 + 3 * s) * from.v[i] + h * s / 2 * from.a[i])) +
            s3 * ((1 + 3 * r + 6 * r * r) * to.q[i] - h * r * ((1 + 3 * r) * to.v[i] - h * r / 2 * to.a[i]));
  guessed_ = q_;
  if (!newton(t, y) || moved_since(guessed_) > kNear * scale_) return false;
  take_solved(t);
  return true;
}

bool MaggiPositions::walk(double t_from, double t, const double* y) {
  read_from(t_from, y);
  if (!newton(t_from, y_from_.data())) return false;
  for (double s = 0; s < 1;) {
    // q' = S (-Phi_t dt) + R dy, as the way goes from 0 to 1.
    for (int i = 0; i < m_; ++i) rate_[i] = -assembly_.phi_t[i] * (t - t_from);
    for (std::size_t k = 0; k < y_part_.size(); ++k) rate_[static_cast<std::size_t>(m_) + k] = y[k] - y_from_[k];
    chart().solve(rate_.data());
    const double pace = largest(rate_.data()) / scale_;
    double part = std::min(1 - s, kNear / std::max(pace, kNear));
    walked_ = q_;
    for (bool there = false; !there; part *= 0.25) {
      if (!(part > kShortest)) return false;
      const bool last = s + part > 1 - kShortest;
      const double next = last ? 1 : s + part;
      for (std::size_t i = 0; i < q_.size(); ++i) q_[i] = walked_[i] + part * rate_[i];
      for (std::size_t k = 0; k < y_part_.size(); ++k)
        y_part_[k] = last ? y[k] : y_from_[k] + next * (y[k] - y_from_[k]);
      there = newton(last ? t : t_from + next * (t - t_from), y_part_.data());
      there = there && moved_since(walked_) <= kFar * scale_;
      if (there) s = next;
    }
  }
  return true;
}

}  // namespace costate
