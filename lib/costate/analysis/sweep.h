// Kinematic sweeps: one coordinate is led through a range, the other held positions stay, and the constraints
// (and balance, where freedom is left) determine the rest, point by point by continuation. Ends early where
// the mechanism locks.
#pragma once

#include <string>
#include <vector>

#include "costate/analysis/equilibrium.h"

namespace costate {

struct SweepPoint {
  double value = 0;  // of the swept coordinate
  Equilibrium at;
};

struct Sweep {
  std::vector<SweepPoint> points;  // from `from` on; all `count` of them unless it stopped
  std::string stopped;             // why it stopped early, or empty
  double reached = 0;              // the last value that could be reached
};

/// Leads `coordinate` from its first guess to `from` and on to `to` in `count` >= 2 equally spaced points.
/// `held` are the others that are held (an entry for the coordinate itself is ignored). Throws ModelError
/// where not even `from` can be reached or where something is left undetermined.
Sweep sweep_position(Assembly& assembly, double t, const std::vector<HeldPosition>& held, int coordinate, double from,
                     double to, int count);

}  // namespace costate
