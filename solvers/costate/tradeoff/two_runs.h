// Whether two runs, the second at a tighter tolerance, tell the error of the second. The first two of a search do not:
// they agree by chance once in so many scenes, over stick and slip above all (of 540 requests of a crane with friction
// and others two were missed so, one by six times, and what the first two did better than asked told nothing of it).
// And where runs take the same steps, as something else than the tolerance bounds these (looks at laws of time), or the
// second fewer, their difference tells nothing.
#pragma once

#include "costate/sensitivity/error_estimate.h"

namespace costate {

struct TwoRuns {
  long before = 0, steps = 0;         // of both
  bool first_two = true;              // of a search
  double relative = 0, accuracy = 0;  // the error that they tell of the second, and what is asked for

  bool other_steps() const { return takes_other_steps(before, steps); }
  bool tell() const {
    if (first_two) return false;
    // Steps that are a few more are not all bound by something else: of errors that leave that much room they tell.
    return other_steps() || (a_few_more() && kOfFewMore * relative <= accuracy);
  }

  /// By how much what they tell is widened.
  double chance() const { return other_steps() ? 1 : kOfFewMore; }

  bool a_few_more() const { return static_cast<double>(steps) >= kFewMore * static_cast<double>(before); }

  static constexpr double kFewMore = 1.05, kOfFewMore = 10;
  /// To the next tolerance where steps were the same.
  static constexpr double kFurther = 1e-2;
};

}  // namespace costate
