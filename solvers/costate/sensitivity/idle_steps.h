// Gradients of Runge-Kutta steps where the motion itself tells nothing of how long they may be. lib/README.md (16.5).
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/problem/known_error.h"
#include "costate/problem/problem.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

/// Steps of a motion that tells nothing of their length: how long they may be, and how long they were; and whether the
/// gradient is there, and what it has grown by is being judged.
struct IdleSteps {
  double bound, longest = 0;
  bool judged = false;
};

/// The gradient by steps so short that it no longer changes, where the motion tells nothing of their length (at rest,
/// in uniform motion): any are exact to it, and derivatives, which have a course of their own, are those of steps too
/// long for them. Such steps are bounded by a part of the run, which depends a little on the tolerance, so that a run
/// at another one tells; where they are most of the run they are halved until nothing changes. once(idle) is the
/// gradient by steps that heed idle.bound; Kind: theirs (integrator/runge_kutta_kinds.h).
template <class Kind, class Once>
GradientResult settled(const Problem& problem, const Once& once) {
  // What changes by so many tolerances has settled: steps half as long have a fraction of that error left.
  constexpr double kSettled = 100, kRounding = 1e-10;
  constexpr int kMostThatGrow = 10;
  // Of the run's time, at first, at this tolerance; explicit steps have to be stable, too. A hundredth of the tolerance
  // makes them shorter by 1.3, by which errors change enough to be seen, and steps less than where errors choose them
  // (confirmation.cpp).
  constexpr double kFirst = Kind::implicit ? 1.0 / 32 : 1.0 / 64, kLoose = 1e-3, kWeak = 0.055;
  // As many steps as that, against the first, and no more.
  constexpr long kMostTimes = 4, kFew = 4000;
  const OwnNotices notices;
  const double allowed = std::max(kSettled * problem.solver.rtol, kRounding);
  // Null of steps too long for derivatives, which may grow without bound.
  const auto by_steps_of = [&](double length, bool last_chance, double& longest) {
    IdleSteps idle{length};
    std::optional<GradientResult> r;
    notices.forget();
    try {
      r = once(idle);
    } catch (const SolverError&) {
      if (!idle.judged || idle.longest == 0 || last_chance) throw;
    }
    longest = idle.longest;
    return r;
  };
  // In parts of the gradient's size; what is nothing to a cost is none.
  const auto apart = [&](const std::optional<GradientResult>& a, const GradientResult& b) {
    const double change = a ? largest_scaled_change(problem.parameters, a->gradient, b.gradient) : HUGE_VAL;
    if (change <= negligible_cost(problem)) return 0.0;
    return change / gradient_size(problem.parameters, b.psi, b.gradient);
  };
  double longest = 0;
  std::optional<GradientResult> r = by_steps_of(
      kFirst * (problem.solver.t_end - problem.solver.t_start) * std::pow(problem.solver.rtol / kLoose, kWeak), false,
      longest);
  if (r && longest == 0) return *r;
  const long most_steps = r ? kMostTimes * r->counters.steps + kFew : kFew;
  if (r) {
    // Longer ones are cheaper; of these nothing is wanted but whether they do as well.
    std::optional<GradientResult> coarse;
    try {
      const Unsaid coarser;
      double other = 0;
      coarse = by_steps_of(2 * longest, false, other);
    } catch (const SolverError&) {
      // Too long for something else.
    }
    if (apart(coarse, *r) <= allowed) return *r;
  }
  for (int halvings = 1;; ++halvings) {
    const double length = 0.5 * longest;
    std::optional<GradientResult> next = by_steps_of(length, halvings == kMostThatGrow, longest);
    if (next) {
      const double change = apart(r, *next);
      if (r) next->counters.simulations += r->counters.simulations;
      if (longest == 0 || change <= allowed) return *next;
      if (r && 2 * next->counters.steps > most_steps) {
        widen_error(*next, problem.parameters, 0,
                    change * gradient_size(problem.parameters, next->psi, next->gradient));
        notice(
            fmt::format("The motion is at rest, or uniform, and tells nothing of how long steps may be; with steps "
                        "of {:.2g} s, half as long as before, the gradient still changes by {:.1g} of its largest "
                        "scaled derivative. Take another method (idas-adjoint, cvodes-adjoint, hand-adjoint).",
                        length, change));
        return *next;
      }
    }
    r = std::move(next);
  }
}

}  // namespace costate
