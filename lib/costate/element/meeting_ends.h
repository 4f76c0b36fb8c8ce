// Forces along the line between two points, F n with n = d / |d|. Where the points pass through each other n turns
// round at once, and a force that is not zero there jumps: from F n to -F n.
#pragma once

#include "costate/element/element.h"

namespace costate {

/// Such a force is one of these as well.
class MeetingEnds {
 public:
  virtual ~MeetingEnds() = default;
  /// d (3, 0 across a plane) and its rate.
  virtual void ends_apart(const LocalState& s, double* d, double* rate) const = 0;
  /// By how much the force on an end jumps where they meet at this speed [m/s]: F(0, speed) + F(0, -speed) [N].
  /// Infinite where states of the force, which are not asked for, decide.
  virtual double jump_where_ends_meet(const LocalState& s, double speed) const = 0;
};

}  // namespace costate
