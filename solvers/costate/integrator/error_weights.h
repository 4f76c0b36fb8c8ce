// The weights of IDAS's norms: 1 / (rtol |y| + atol), and for accelerations and multipliers not below what rounding
// makes of them. These follow from differences of the velocities over a step h, so that an accuracy finer than eps |v|
// / h is noise: with an absolute tolerance alone Newton's test would fail wherever one of them passes through zero.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "costate/formulation/system.h"

namespace costate {

/// The part of their absolute tolerance that velocities are given: with one number for positions and velocities alike a
/// slow motion of a large mechanism would have few digits. They get the tolerance of the largest velocity met so far,
/// within three decades.
class SpeedPart {
 public:
  /// For a run that has to be repeated to the bit: all of it, always.
  void fix() { fixed_ = true; }
  /// The tolerances `atol` of y are those of unknowns of size 1 times `unit`.
  double at(const std::vector<Unknown>& unknowns, const double* y, const double* atol, double unit) {
    if (fixed_) return 1;
    for (std::size_t i = 0; i < unknowns.size(); ++i)
      if (unknowns[i].role == Unknown::Role::velocity) largest_ = std::max(largest_, std::abs(y[i]) * unit / atol[i]);
    return std::clamp(largest_, kLeast, 1.0);
  }

 private:
  static constexpr double kLeast = 1e-3;
  double largest_ = 0;
  bool fixed_ = false;
};

/// Returns 0, or -1 where a weight would not be positive. atol as in IDASVtolerances, of velocities this part of it; h
/// is 0 before the first step.
int set_error_weights(const std::vector<Unknown>& unknowns, const double* y, double rtol, const double* atol,
                      double speed_part, double h, double* weights);

}  // namespace costate
