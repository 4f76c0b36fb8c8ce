// Gradients of Runge-Kutta steps where the motion itself tells nothing of how long they may be. lib/README.md (16.5).
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/problem/known_error.h"
#include "costate/problem/problem.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

/// Steps of a motion that tells nothing of their length: how long they may be, and how long they were.
struct IdleSteps {
  double bound, longest = 0;
};

/// Notices of what was before a number of runs, and of the last of them.
class LastNotices {
 public:
  LastNotices() : before_(take_notices()) {}
  LastNotices(const LastNotices&) = delete;
  LastNotices& operator=(const LastNotices&) = delete;
  ~LastNotices() {
    const std::vector<std::string> last = take_notices();
    for (const auto& sentence : before_) notice(sentence);
    for (const auto& sentence : last) notice(sentence);
  }

 private:
  std::vector<std::string> before_;
};

/// The gradient by steps so short that it no longer changes, where the motion tells nothing of their length (at rest,
/// in uniform motion): any are exact to it, and derivatives, which have a course of their own, are those of steps too
/// long for them. Such steps are bounded by the tolerance, as others are by their errors, so that a run at another
/// tolerance tells; where they are most of the run they are halved until nothing changes. once(idle) is the gradient by
/// steps that heed idle.bound, `order` their scheme's.
template <class Once>
GradientResult settled(const Problem& problem, int order, const Once& once) {
  // What changes by so many tolerances has settled: steps half as long have a fraction of that error left.
  constexpr double kSettled = 100, kRounding = 1e-10;
  constexpr int kMost = 20;
  // Of the run's time, at first, at this tolerance.
  constexpr double kFirst = 1.0 / 32, kLoose = 1e-3;
  constexpr long kMostSteps = 200'000;
  const LastNotices notices;
  IdleSteps idle{kFirst * (problem.solver.t_end - problem.solver.t_start) *
                 std::pow(problem.solver.rtol / kLoose, 1.0 / order)};
  std::optional<GradientResult> last;
  for (int halvings = 0;; ++halvings) {
    std::optional<GradientResult> next;
    idle.longest = 0;
    take_notices();
    try {
      next = once(idle);
    } catch (const SolverError&) {  // of steps too long for them derivatives may grow without bound
      if (idle.longest == 0 || halvings == kMost) throw;
    }
    if (next) {
      if (last) next->counters.simulations += last->counters.simulations;
      const double size = gradient_size(problem.parameters, next->psi, next->gradient),
                   change = last ? largest_scaled_change(problem.parameters, last->gradient, next->gradient) : HUGE_VAL;
      if (idle.longest == 0 || change <= std::max(kSettled * problem.solver.rtol, kRounding) * size) return *next;
      if (last && (halvings == kMost || next->counters.steps > kMostSteps)) {
        widen_error(*next, problem.parameters, 0, change);
        notice(
            fmt::format("The motion is at rest, or uniform, and tells nothing of how long steps may be; with steps "
                        "of {:.2g} s, half as long as before, the gradient still changes by {:.1g} of its largest "
                        "scaled derivative. Take another method (idas-adjoint, cvodes-adjoint, hand-adjoint).",
                        idle.bound, change / size));
        return *next;
      }
    }
    last = std::move(next);
    idle.bound = 0.5 * idle.longest;
  }
}

}  // namespace costate
