#include "costate/event/grazing_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/element/unilateral_force.h"

namespace costate {

namespace {
// From so far, in parts of the gap's range, a touch is one of its own.
constexpr double kFromAfar = 1e-3;
// What turns round faster than this many times what it was about to is thrown back.
constexpr double kThrownBack = 4;
}  // namespace

GrazingWatch::GrazingWatch(const Mechanism& mechanism) {
  for (std::size_t f = 0; f < mechanism.forces().size(); ++f) {
    const Force& force = *mechanism.forces()[f];
    const auto* guarded = dynamic_cast<const GuardedForce*>(&force);
    const auto* gaps = dynamic_cast<const GapElement*>(&force);
    if (!guarded || !gaps) continue;
    for (int k = 0; k < guarded->guard_count(); ++k)
      if (gaps->gap_of_guard(k) >= 0 && guarded->guard_direction(k) < 0)
        guards_.push_back({&force, guarded, gaps, k, mechanism.state_offsets()[f]});
  }
}

void GrazingWatch::keep(Guard& g, double t, double depth) {
  // Of many that which is shallowest against where it came from: a run may have ten thousand touches.
  if (!g.shallowest || depth * g.shallowest->farthest < g.shallowest->depth * g.farthest)
    g.shallowest = {t, depth, g.farthest};
}

void GrazingWatch::keep_expected(Guard& g) {
  // What falls ever faster is not turning round.
  if (g.rate < 0 && g.turns > 0) keep(g, g.t - g.rate / g.turns, std::abs(g.gap - g.rate * g.rate / (2 * g.turns)));
}

std::string GrazingWatch::name_of(const Guard& g) {
  return fmt::format("{}: {}", g.force->path(), g.guarded->guard_name(g.k));
}

std::pair<LocalState, GapMotion> GrazingWatch::motion_of(const Guard& g, const StateView& s, const Assembly& assembly) {
  LocalState local = gathered_.of(*g.force, s, assembly.numbers());
  local.z = s.z + g.first_state;
  return {local, g.gaps->gap_motion(g.gaps->gap_of_guard(g.k), local)};
}

std::optional<std::string> GrazingWatch::impact_within(double seconds, const StateView& s, const Assembly& assembly) {
  for (const Guard& g : guards_) {
    if (!dynamic_cast<const UnilateralForce*>(g.force) || !g.guarded->guard_armed(g.k, s.z + g.first_state)) continue;
    const GapMotion m = motion_of(g, s, assembly).second;
    if (m.rate < 0 && m.gap < -m.rate * seconds) return name_of(g);
  }
  return {};
}

void GrazingWatch::look(const StateView& s, const Assembly& assembly) {
  for (Guard& g : guards_) {
    const auto [local, m] = motion_of(g, s, assembly);
    g.least = std::min(g.least, m.gap);
    g.most = std::max(g.most, m.gap);
    const bool armed = g.guarded->guard_armed(g.k, local.z);
    if (!armed || std::isnan(g.guarded->guard_value(g.k, local))) {  // no number: it is let pass
      if (!armed && !std::isnan(g.t)) keep_expected(g);
      g.t = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    if (std::isnan(g.t)) {
      g.farthest = g.turns = 0;
    } else if (s.t > g.t) {
      const double turns = (m.rate - g.rate) / (s.t - g.t);
      if (!(g.rate < 0 && m.rate >= 0))
        g.turns = turns;
      else if (!(g.turns > 0) || turns > kThrownBack * g.turns)
        keep_expected(g);         // an impact
      else if (-g.rate < m.rate)  // from the side that is nearer to where it turned
        keep(g, g.t - g.rate / turns, std::abs(g.gap - g.rate * g.rate / (2 * turns)));
      else
        keep(g, s.t - m.rate / turns, std::abs(m.gap - m.rate * m.rate / (2 * turns)));
    } else if (g.rate < 0 && m.rate >= 0) {
      keep_expected(g);
    }
    g.farthest = std::max(g.farthest, m.gap);
    g.t = s.t;
    g.gap = m.gap;
    g.rate = m.rate;
  }
}

std::optional<GrazingWatch::Place> GrazingWatch::nearest() const {
  std::optional<Place> least;
  for (const Guard& g : guards_) {
    const double range = g.most - g.least;
    if (!g.shallowest || g.shallowest->farthest < kFromAfar * range) continue;
    if (least && least->depth / least->range <= g.shallowest->depth / range) continue;
    least = {g.shallowest->t, name_of(g), g.shallowest->depth, range};
  }
  return least;
}

}  // namespace costate
