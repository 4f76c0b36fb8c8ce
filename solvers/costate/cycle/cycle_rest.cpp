#include "costate/cycle/cycle_rest.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/base/unsaid.h"
#include "costate/integrator/simulate.h"

namespace costate {

namespace {

constexpr int kSamples = 100;
constexpr double kWithin = 1e3;        // a fixed point is one within as many (CycleOptions::accepted)
constexpr double kPartOfFirst = 1e-3;  // of what the search began with
constexpr double kMoves = 1e6;         // in tolerances, the way at the section's speed: no need to look at the motion

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  double size() const { return high - low; }
  double tolerance(const SolverOptions& s) const {
    return s.rtol * std::max(std::abs(low), std::abs(high)) + s.absolute();
  }
};

/// Of the coordinates and the force states.
std::vector<Range> ranges(const ReturnMap& map, const Eigen::VectorXd& x, const std::vector<double>& positions,
                          double time) {
  std::vector<double> values;
  Problem p = map.motion_from(x, positions, values);
  p.objective = {};
  p.ends_when.reset();
  p.solver.t_end = p.solver.t_start + time;
  std::vector<double> times;
  for (int k = 0; k <= kSamples; ++k) times.push_back(p.solver.t_start + time * k / kSamples);
  const int n = p.mechanism->coordinate_count(), nz = p.mechanism->state_count();
  std::vector<Range> all(static_cast<std::size_t>(n + nz));
  simulate(p, values, times, [&](const MechanismState& s, System&) {
    for (int i = 0; i < n + nz; ++i) {
      Range& r = all[static_cast<std::size_t>(i)];
      const double at = i < n ? s.q[i] : s.z[i - n];
      r.low = std::min(r.low, at);
      r.high = std::max(r.high, at);
    }
  });
  return all;
}

bool looks_at_rest(const ReturnMap& map, const CycleStart& start, const Eigen::VectorXd& x,
                   const std::vector<double>& positions, double time) {
  const SolverOptions& s = map.problem().solver;
  const ReturnMap::State at = map.state(x, positions);
  for (std::size_t i = 0; i < at.q.size(); ++i)
    if (std::abs(at.v[i]) * time > kMoves * (s.rtol * std::abs(at.q[i]) + s.absolute())) return false;
  const std::vector<Range> found = ranges(map, x, positions, time);
  const auto within = [&](double tolerances) {
    return std::all_of(found.begin(), found.end(),
                       [&](const Range& r) { return r.size() <= tolerances * r.tolerance(s); });
  };
  if (within(1)) return true;
  if (!within(kWithin)) return false;
  const std::vector<Range> first = ranges(map, start.x(), start.positions(), time);
  for (std::size_t i = 0; i < found.size(); ++i)
    if (found[i].size() > std::max(found[i].tolerance(s), kPartOfFirst * first[i].size())) return false;
  return true;
}

}  // namespace

bool rests(const ReturnMap& map, const CycleStart& start, const Eigen::VectorXd& x,
           const std::vector<double>& positions, double time) {
  try {
    const Unsaid look;
    return looks_at_rest(map, start, x, positions, time);
  } catch (const SolverError&) {  // what cannot be run moves
    return false;
  }
}

}  // namespace costate
