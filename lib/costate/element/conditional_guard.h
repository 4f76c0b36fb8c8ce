// Guards that are looked at under a condition on another point: a foot that touches only where it is ahead of the other
// one, a knee that is let go there.
#pragma once

#include "costate/element/element.h"

namespace costate {

/// A GuardedForce that has some derives from this as well.
class ConditionalGuard {
 public:
  virtual ~ConditionalGuard() = default;
  /// Along the plane, how far its own point is ahead: the condition holds where that is positive; and what guard k
  /// would be with the other point in the place of its own. NaN without a condition.
  struct Other {
    double ahead, guard;
  };
  virtual Other other(int k, const LocalState& s) const = 0;
};

}  // namespace costate
