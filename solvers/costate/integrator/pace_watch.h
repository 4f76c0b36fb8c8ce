// Notices a run that will not end: at its pace, steady for thousands of steps, it would take more steps than the limit
// (SolverOptions::max_steps). Without it the cause is named only once the limit is reached, which may be hours later.
#pragma once

#include <algorithm>
#include <cmath>

namespace costate {

class PaceWatch {
 public:
  /// After each step: t after `steps` steps on the way to `end`. Returns the steps that the run would take, once
  /// kHopeless intervals in a row say that these are more than `most` and none was faster than the one before; else 0.
  double projected(double t, long steps, double end, long most) {
    if (steps < mark_ || !started_) return begin(t, steps);
    if (steps - mark_ < kInterval) return 0;
    const double pace = std::abs(t - t_mark_) / static_cast<double>(steps - mark_);
    const double all = static_cast<double>(steps) + std::abs(end - t) / pace;
    // Where it is far too slow, a pace that goes up and down does not count as one that grows.
    const double excess = all / static_cast<double>(most);
    const bool faster = pace > 1.1 * (excess > kFar ? fastest_ : pace_);
    fastest_ = excess > kFar ? std::max(fastest_, pace) : 0;
    hopeless_ = excess > 1 && !faster ? hopeless_ + 1 : 0;
    pace_ = pace;
    mark_ = steps;
    t_mark_ = t;
    return hopeless_ >= kHopeless ? all : 0;
  }

 private:
  static constexpr long kInterval = 250;
  // A short stiff episode (an impact) is over by then.
  static constexpr int kHopeless = 40;
  static constexpr double kFar = 100;
  double begin(double t, long steps) {
    *this = {};
    started_ = true;
    mark_ = steps;
    t_mark_ = t;
    return 0;
  }
  bool started_ = false;
  long mark_ = 0;
  int hopeless_ = 0;
  double t_mark_ = 0, pace_ = 0, fastest_ = 0;
};

}  // namespace costate
