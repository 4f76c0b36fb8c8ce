// Notices an integrator that no longer gets on: next to a singularity the step falls below the rounding of the time,
// and SUNDIALS goes on with steps of nothing until its limit of steps, which may be hours away.
#pragma once

#include <cmath>
#include <limits>

namespace costate {

class StallWatch {
 public:
  /// To be called at every evaluation, in either direction of time; true after 5000 evaluations within a few roundings
  /// of the same time (a regular step, restarts included, takes some dozens).
  bool stalled(double t) {
    if (std::abs(t - t_) > 1e3 * std::numeric_limits<double>::epsilon() * std::abs(t)) {
      t_ = t;
      evaluations_ = 0;
    }
    return ++evaluations_ > 5000;
  }

 private:
  double t_ = 0;
  int evaluations_ = 0;
};

}  // namespace costate
