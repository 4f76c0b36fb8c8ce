// Whether a motion in independent coordinates stays on its branch. Where these coordinates turn back (a bar's end at
// its highest, described by its height) the positions that depend on them go through, to where the same values mean
// another position; a step long enough to begin and end well away from there meets nothing singular, finds the position
// that is nearer to where it began, and sends the motion back the way it came. Energy, constraints and the integrator's
// error estimate are content with that. But velocities have turned round that no acceleration turned.
#pragma once

#include <limits>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

class BranchWatch {
 public:
  /// Keeps (t, v, a) of n coordinates, the end of a step.
  void keep(const StateView& s, int n);
  /// Nothing is kept: a run begins, or velocities jump.
  void forget() { t_ = std::numeric_limits<double>::quiet_NaN(); }
  /// The time of what is kept, or NaN.
  double kept() const { return t_; }
  /// Since what is kept, the coordinate whose velocity turned round otherwise than by the accelerations at both ends,
  /// by more than this part of itself; or -1. One of the `independent` coordinates has turned round, too, as it does
  /// there. `sizes`, one a coordinate: what it moves by where it moves by the mechanism's size.
  int turned(const StateView& s, double part, const std::vector<double>& sizes,
             const std::vector<int>& independent) const;

 private:
  /// Whether the i-th velocity turns round, and by more than rounding at rest.
  bool turns_round(const StateView& s, std::size_t i, const std::vector<double>& sizes) const;
  double t_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> v_, a_, largest_;  // of each coordinate; its largest speed so far
};

}  // namespace costate
