// What the events of a mechanism (event/motion_events.h) know of each guard, and of each rigid contact.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "costate/element/unilateral_force.h"
#include "costate/event/gap_trace.h"

namespace costate {

struct WatchedGuard {
  const Force* force;
  const GuardedForce* guarded;
  int k;            // of the force's own
  int first_state;  // of the force, among all
  std::string name;
  int contact = -1;        // of all
  int first_row = -1;      // of the constraint that its multipliers are of
  bool just_left = false;  // of a rigid contact behind an impact or a release: the gap grows from zero
  bool ready = false;      // seen on the side from which it crosses
  double last = std::numeric_limits<double>::quiet_NaN();  // its value at the last look, if it was looked at
  double largest_slip = 0;                                 // of the stop of a slip in space that goes on
  double largest_in_space = 0, offset[2] = {0, 0};         // likewise, of a slip in space with this offset
  std::optional<GapTrace> gap = {};
  GapTrace::Look seen = {std::numeric_limits<double>::quiet_NaN(), {}};  // of the gap, where the step before has ended
};

/// A rigid contact, and what it is behind the last event.
struct WatchedContact {
  const Force* force;
  const UnilateralForce* contact;
  int closed_state;   // among all, or -1
  int sliding_state;  // likewise
  int first_row;      // of its constraint, or -1
  int part;           // of the mechanism (mechanism/coordinate_parts.h): others take no part in its events
  double largest_approach = 0;
  std::vector<double> died_at = {};  // when its bounces had died out; known up to `decided`, for the way back
  double decided = -std::numeric_limits<double>::infinity();
  /// For how long it would still bounce where it has closed, as that had died out.
  struct Unseen {
    double since = std::numeric_limits<double>::quiet_NaN(), lasts_s = 0;
  };
  Unseen unseen = {};
  bool closed = false;
  int slides = 0;  // the direction
};

}  // namespace costate
