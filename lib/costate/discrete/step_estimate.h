// What a step of a Runge-Kutta scheme gets wrong, by its embedded estimate.
#pragma once

#include <algorithm>
#include <cmath>

namespace costate {

struct StepEstimate {
  /// Of the step, in tolerances: root mean square over the state, and psi's own where that is larger.
  double error = 0;
  /// The part of the rates that the step gets wrong: what its derivative is off by where a force bends within it,
  /// however short it is. 0 where next to nothing moves.
  double rate_error = 0;
  /// The largest of a velocity; of implicit schemes.
  double velocity = 0;
};

/// The largest rate of psi in the steps so far, against which an error of it counts: shares of a gradient add up.
class CostPace {
 public:
  /// The part of psi's rates that a step over h gets wrong by `off`, with the rates at its ends; 0 where the step could
  /// not make more of psi than `tolerance`: at rest its rates are rounding.
  double rate_error(double off, double h, double rate_at_start, double rate_at_end, double tolerance) {
    fastest_ = std::max({fastest_, std::abs(rate_at_start), std::abs(rate_at_end)});
    return h * fastest_ > tolerance ? off / (h * fastest_) : 0;
  }

 private:
  double fastest_ = 0;
};

}  // namespace costate
