// Where forces and running costs bend along a motion that a way back is to follow. The force is continuous there, its
// derivatives jump; between two passages of a place that are near each other they are a pulse that steps of the way
// back, smooth as the adjoint is, would lead over: where the formula dips below a bound for a moment, with a parameter
// in the bound, all of the gradient may lie within these.
#pragma once

#include <vector>

#include "costate/event/bend_watch.h"

namespace costate {

class BendRecord {
 public:
  /// As BendWatch.
  BendRecord(Assembly& assembly, const Objective& objective, double rtol, double atol);

  bool empty() const { return watch_.empty(); }
  /// Of each step of the run, in order of time; one that is taken anew is told once more.
  void add_step(double from, double to, const GapTrace::States& at);
  /// When places were passed, in order; nearer to each other than rounding of the time is once.
  std::vector<double> passages() const;

 private:
  BendWatch watch_;
  std::vector<std::vector<BendWatch::Passage>> met_;  // of each place
};

}  // namespace costate
