// Forces that jump where the motion comes to a place, no event telling of it: a tyre whose damper sets in at once,
// branches of a model that do not meet. Integrators find the instant as well as any other; what it depends on is in no
// derivative.
#pragma once

#include <vector>

#include "costate/element/element.h"

namespace costate {

struct JumpPlace {
  double beyond;      // zero at the place
  int direction = 0;  // in which passing it counts: 1 rising, -1 falling, 0 both
  double jump = 0;    // of the force there, as far as this state tells, N; 0: it does not
  const char *what = "", *advice = "";
  /// No jump but something that motions are to be told of; of them it counts where `beyond` is negative at the start,
  /// too.
  bool of_motion = false;
  /// What begins at the place is whole this far beyond it, in the units of `beyond`: a jump to a fixed step alone that
  /// passes all of it.
  double over = 0;
  const char* unit = "N";  // of the jump
};

/// A force that may is one of these as well.
class JumpingForce {
 public:
  virtual ~JumpingForce() = default;
  /// Appends its places, as many and in the same order at every state.
  /// `fixed_steps`: whether those are asked for, too, that only fixed steps pass by.
  virtual void add_jump_places(const LocalState& s, bool fixed_steps, std::vector<JumpPlace>& places) const = 0;
};

}  // namespace costate
