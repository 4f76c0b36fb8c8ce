// Notices a run that will not end: at its pace, steady for thousands of steps, it would take more steps than the limit
// (SolverOptions::max_steps). Without it the cause is named only once the limit is reached, which may be hours later.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace costate {

class PaceWatch {
 public:
  /// After each step: t after `steps` steps on the way to `end`. Returns the steps that the run would take, once these
  /// are more than `most` at the pace of the last intervals and the later half of them was not faster than the earlier
  /// one; else 0. A pace goes up and down where errors are noise: single intervals say nothing.
  double projected(double t, long steps, double end, long most) {
    if (marks_ == 0 || steps < last(0).steps) {
      marks_ = 0;
      begun_ = false;
      mark(t, steps);
      return 0;
    }
    if (steps - last(0).steps < kInterval) return 0;
    if (!begun_) marks_ = 0;  // the first interval holds the steps of the start
    begun_ = true;
    mark(t, steps);
    for (const Look& look : kLooks) {
      if (marks_ <= 2 * look.half) return 0;
      const double earlier = pace(last(2 * look.half), last(look.half)), later = pace(last(look.half), last(0));
      const double all = static_cast<double>(steps) + std::abs(end - t) / pace(last(2 * look.half), last(0));
      if (all > look.times * static_cast<double>(most) && !(later > 1.1 * earlier)) return all;
    }
    return 0;
  }

 private:
  static constexpr long kInterval = 250;
  // The last intervals, in two halves, and how many times the limit the run would take at their pace. A short stiff
  // episode (an impact) is over by then; the further a run is from its end, the less such a one can be what holds it.
  struct Look {
    std::size_t half;
    double times;
  };
  static constexpr Look kLooks[] = {{5, 100}, {10, 4}, {20, 1}};
  struct Mark {
    double t = 0;
    long steps = 0;
  };
  static double pace(const Mark& from, const Mark& to) {
    return std::abs(to.t - from.t) / static_cast<double>(to.steps - from.steps);
  }
  void mark(double t, long steps) { kept_[marks_++ % kept_.size()] = {t, steps}; }
  const Mark& last(std::size_t back) const { return kept_[(marks_ - 1 - back) % kept_.size()]; }

  std::array<Mark, 2 * kLooks[2].half + 1> kept_;
  std::size_t marks_ = 0;
  bool begun_ = false;
};

}  // namespace costate
