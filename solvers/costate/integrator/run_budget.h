// What a run among many may take, as those of 'costate check': so many times the steps and the processor time of
// another. One that takes more is cut: it is neither right nor wrong, and the others are not kept waiting.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <ctime>
#include <limits>
#include <stdexcept>
#include <thread>

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

  static constexpr double kNoLimit = std::numeric_limits<double>::infinity();

  /// From here on: at most `seconds` in all, and `steps` in each run. Runs may be of other threads than this one.
  void begin(double seconds, double steps = kNoLimit) {
    static std::atomic<long> begun{0};
    seconds_ = seconds;
    steps_ = steps;
    thread_ = std::this_thread::get_id();
    number_ = ++begun;
    began_ = processor_s();
    others_ = 0;
  }
  void unlimited() { seconds_ = steps_ = kNoLimit; }

  /// Throws Cut.
  void look(double t, long steps, bool backward) const {
    const char* where = backward ? " on the way back" : "";
    if (static_cast<double>(steps) > steps_)
      throw Cut(fmt::format("after {} steps at t = {:.4g} s{}, its limit of steps", steps, t, where));
    const double spent = seconds_ < kNoLimit ? spent_s() : 0;
    if (spent > seconds_) throw Cut(fmt::format("after {:.2g} s of processor time at t = {:.4g} s{}", spent, t, where));
  }

 private:
  /// Of the thread that began, and of all others from where they looked first.
  double spent_s() const {
    const double now = processor_s();
    const std::atomic_ref others(others_);
    if (std::this_thread::get_id() == thread_) return now - began_ + others;
    struct LastLook {
      long number = 0;
      double at = 0;
    };
    thread_local LastLook last;
    const double since = last.number == number_ ? now - last.at : 0;
    last = {number_, now};
    return others.fetch_add(since) + since;
  }

  double seconds_ = kNoLimit, steps_ = kNoLimit, began_ = 0;
  long number_ = 0;
  std::thread::id thread_;
  alignas(std::atomic_ref<double>::required_alignment) mutable double others_ = 0;
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
