// Whether two runs, the second at a tighter tolerance, tell the error of the second: they may agree by chance, over
// stick and slip above all, and the more so the looser they are and the fewer steps they take; and where they take the
// same steps, as something else than the tolerance bounds these (looks at laws of time), or the second fewer, their
// difference tells nothing.
#pragma once

#include "costate/sensitivity/error_estimate.h"

namespace costate {

struct TwoRuns {
  double looser = 0;                  // rtol of the first
  long before = 0, steps = 0;         // of both
  bool first_two = true;              // of a search; a third one told more
  double relative = 0, accuracy = 0;  // the error that they tell of the second, and what is asked for

  bool other_steps() const { return takes_other_steps(before, steps); }
  /// The first two have to do so much better than asked, or a third one tells.
  bool tell() const {
    // Steps that are a few more are not all bound by something else: of errors that leave that much room they tell.
    if (!other_steps()) return !first_two && a_few_more() && kOfFewMore * relative <= accuracy;
    if (!first_two) return true;
    const bool loose = looser > kByChanceAt;
    return !(loose && steps < kFewSteps) && relative <= (loose ? kFirstTwo : kFirstTwoTight) * accuracy;
  }

  /// By how much what they tell is widened: what the first two do better than asked is left for what is chance.
  double chance() const {
    if (!other_steps()) return kOfFewMore;
    return !first_two ? 1 : looser > kByChanceAt ? 0.75 / kFirstTwo : 1 / kFirstTwoTight;
  }

  bool a_few_more() const { return static_cast<double>(steps) >= kFewMore * static_cast<double>(before); }

  static constexpr double kFewMore = 1.05, kOfFewMore = 10;
  static constexpr double kByChanceAt = 1e-4, kFirstTwo = 0.25, kFirstTwoTight = 0.5;
  static constexpr long kFewSteps = 30;
  /// To the next tolerance where steps were the same.
  static constexpr double kFurther = 1e-2;
};

}  // namespace costate
