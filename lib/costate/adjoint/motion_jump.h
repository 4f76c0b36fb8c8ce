// Where a stored motion jumps, as hand-derived equations are carried across: at kinks of drivers, where parameters move
// the time of a jump of the accelerations, and at events of the mechanism.
#pragma once

#include <vector>

namespace costate {

/// An event (event/motion_events.h) that the motion meets.
struct MetEvent {
  double t = 0;
  int event = -1;
  std::vector<double> qvz;  // the state before it
};

/// One place of a motion: `before` is the last instant before it, `after` the first one behind it.
struct MotionJump {
  double before = 0, after = 0;
  std::vector<MetEvent> events;  // of one instant, in their order; none: what a law of time does there
};

/// All such places within t_start < t < t_end (events also at t_start), in order: at `times`, and the events.
std::vector<MotionJump> motion_jumps(const std::vector<double>& times, const std::vector<MetEvent>& events);

/// The grid with the instants before the jumps among its points; a point of its own so near to one that a step between
/// them would be lost in rounding gives way.
std::vector<double> with_jumps(const std::vector<double>& grid, const std::vector<MotionJump>& jumps);

}  // namespace costate
