#include "costate/event/gap_trace.h"

#include <algorithm>
#include <cmath>

#include "costate/assembly/gathered_state.h"

namespace costate {

namespace {
// V, in the speeds at both ends and in |g(b) - g(a)|/(b - a): half a period of an oscillation between two looks that
// find no speed needs pi/2 of the latter.
constexpr double kSpeedUp = 2;
// Where the gap is near zero a step is looked at in this many parts at least, and in parts within which what turns does
// so by no more than this, rad: a cosine has one extremum there.
constexpr int kParts = 4;
constexpr double kTurn = 0.8;
constexpr int kMostBisections = 60;
// Parts of the distance of two looks to which the bottom of a dip and a zero are found.
constexpr double kNearBottom = 1e-2, kNearZero = 1e-5;

bool same_side(double a, double b) { return (a < 0) == (b < 0); }

/// Of a course that is bent upwards: at least this between the looks, by its tangents.
double lower_bound(const GapTrace::Look& a, const GapTrace::Look& b, double sign) {
  const double ga = sign * a.m.gap, gb = sign * b.m.gap, ra = sign * a.m.rate, rb = sign * b.m.rate;
  const double at = (gb - ga + rb * (a.t - b.t)) / (ra - rb);  // behind a
  return ga + ra * at;
}
}  // namespace

double GapTrace::force(const StateView& s, const Assembly& assembly) const {
  thread_local GatheredState own;
  if (!gaps_) return 1;
  LocalState local = own.of(*element_, s, assembly.numbers());
  local.z = s.z;
  return gaps_->gap_force(i_, local);
}

GapTrace::Look GapTrace::look(const StateView& s, const Assembly& assembly) const {
  thread_local GatheredState own;
  const LocalState local = own.of(*element_, s, assembly.numbers());
  if (gaps_) return {s.t, gaps_->gap_motion(i_, local)};
  Look at{s.t, laws_->deformation(local)};
  at.m.gap = begin_.sign * (at.m.gap - local.p[i_] - begin_.x);
  at.m.rate *= begin_.sign;
  return at;
}

bool is_out_of_reach(double both, double by_speed, double between) {
  return both > kSpeedUp * std::max(by_speed, between);
}

bool stays_away(const GapTrace::Look& a, const GapTrace::Look& b) {
  const double h = b.t - a.t;
  const auto away = [&](double ga, double gb, double va, double vb) {
    return is_out_of_reach(std::abs(ga) + std::abs(gb), std::max(va, vb) * h, std::abs(gb - ga));
  };
  const GapMotion &m = a.m, &n = b.m;
  if (same_side(m.gap, n.gap) && away(m.gap, n.gap, m.speed, n.speed)) return true;
  return m.clear > 0 && n.clear > 0 && away(m.clear, n.clear, m.travel, n.travel);
}

void GapTrace::follow(const Look& from, const Look& to, const States& at, const Assembly& assembly,
                      std::vector<Look>& looks) const {
  looks.assign(1, from);
  divide(from, to, to.t - from.t, at, assembly, looks);
}

void GapTrace::divide(const Look& a, const Look& b, double whole, const States& at, const Assembly& assembly,
                      std::vector<Look>& looks) const {
  const double h = b.t - a.t, middle = a.t + 0.5 * h;
  if (!(a.t < middle && middle < b.t) || stays_away(a, b)) {
    looks.push_back(b);
    return;
  }
  if (kParts * h > 1.5 * whole || std::max(a.m.turn, b.m.turn) * h > kTurn) {
    const Look m = look(at(middle), assembly);
    divide(a, m, whole, at, assembly, looks);
    divide(m, b, whole, at, assembly, looks);
    return;
  }
  find_extremum(a, b, at, assembly, looks);
  looks.push_back(b);
}

void GapTrace::find_extremum(Look a, Look b, const States& at, const Assembly& assembly,
                             std::vector<Look>& looks) const {
  // Towards zero from either side, or the bottom below it.
  const bool low = a.m.rate < 0 && b.m.rate > 0, high = a.m.rate > 0 && b.m.rate < 0;
  const bool to_zero = same_side(a.m.gap, b.m.gap) && (a.m.gap < 0 ? high : low);
  if (!to_zero && !(low && std::min(a.m.gap, b.m.gap) < 0)) return;
  const double sign = low ? 1 : -1, whole = b.t - a.t;
  const double side = a.m.gap < 0 ? -1 : 1;
  for (int k = 0; k < kMostBisections; ++k) {
    if (to_zero && lower_bound(a, b, sign) > 0) return;
    if (!to_zero && b.t - a.t < kNearBottom * whole) break;
    const double m = 0.5 * (a.t + b.t);
    if (!(a.t < m && m < b.t)) break;
    const Look middle = look(at(m), assembly);
    // On the other side it is a look of its own; its deepest place is found from there on.
    (sign * middle.m.rate < 0 ? a : b) = middle;
    if (to_zero && !same_side(middle.m.gap, side) && b.t - a.t < kNearBottom * whole) break;
  }
  const Look& deepest = sign * a.m.gap < sign * b.m.gap ? a : b;
  if (to_zero && same_side(deepest.m.gap, side)) return;
  if (looks.back().t < deepest.t) looks.push_back(deepest);
}

double GapTrace::zero(Look a, Look b, const States& at, const Assembly& assembly) const {
  const double whole = b.t - a.t;
  const double side = a.m.gap < 0 ? -1 : 1;
  for (int k = 0; k < kMostBisections && b.t - a.t > kNearZero * whole; ++k) {
    const double part = k % 3 == 2 ? 0.5 : std::clamp(a.m.gap / (a.m.gap - b.m.gap), 0.05, 0.95);
    const Look m = look(at(a.t + part * (b.t - a.t)), assembly);
    (same_side(m.m.gap, side) ? a : b) = m;
  }
  return a.t;
}

}  // namespace costate
