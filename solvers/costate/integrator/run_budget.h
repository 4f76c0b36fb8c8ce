// What a run among many may take, as those of 'costate check': so many times the steps and the processor time of
// another. One that takes more is cut: it is neither right nor wrong, and the others are not kept waiting.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <stdexcept>

#include "costate/problem/problem.h"

namespace costate {

/// No costate::Error: nothing in between takes it for a failure of the run and tries something else.
struct Cut : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class RunBudget {
 public:
  /// Of the calling thread, so that neither a busy machine nor runs beside this one cut anything.
  static double processor_s() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }

  /// From here on: at most `seconds` in all, and `steps` in each run.
  void begin(double seconds, double steps) {
    seconds_ = seconds;
    steps_ = steps;
    began_ = processor_s();
  }
  void unlimited() { seconds_ = steps_ = 0; }

  /// Throws Cut.
  void look(double t, long steps, bool backward) const {
    const char* where = backward ? " on the way back" : "";
    if (steps_ > 0 && static_cast<double>(steps) > steps_)
      throw Cut(fmt::format("after {} steps at t = {:.4g} s{}, its limit of steps", steps, t, where));
    if (seconds_ > 0 && processor_s() - began_ > seconds_)
      throw Cut(fmt::format("after {:.2g} s of processor time at t = {:.4g} s{}", processor_s() - began_, t, where));
  }

 private:
  double seconds_ = 0, steps_ = 0, began_ = 0;
};

/// The problem whose monitor looks at the budget as well. The budget has to outlive its runs.
inline Problem watched(Problem problem, const RunBudget& budget) {
  problem.monitor = [&budget, outer = problem.monitor](double t, long steps, bool backward) {
    if (outer) outer(t, steps, backward);
    budget.look(t, steps, backward);
  };
  return problem;
}

}  // namespace costate
