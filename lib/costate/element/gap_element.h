// What may touch: elements whose forces begin where a gap closes. Integrators choose their steps by what they have met;
// in free flight, or where a body spins, they would step over a touch that begins and ends within one step. An element
// tells of each of its gaps how large it is, how fast it changes, and how fast it could change at most with these
// speeds: so the gap's whole course over a step follows from few looks (event/gap_trace.h).
#pragma once

#include <vector>

#include "costate/element/element.h"

namespace costate {

/// A gap g at one state.
struct GapMotion {
  double gap = 0, rate = 0;  // m, m/s
  /// |g'| with these speeds in whatever position of what turns, m/s; and how fast that turns, rad/s (0 where turning
  /// moves nothing).
  double speed = 0, turn = 0;
  /// What g is at least, however its body is turned about its origin, and how fast that changes at most.
  double clear = 0, travel = 0;
};

/// A force with gaps is one of these as well.
class GapElement {
 public:
  virtual ~GapElement() = default;
  virtual int gap_count() const = 0;
  virtual GapMotion gap_motion(int i, const LocalState& s) const = 0;
  /// Whether a force acts, with these states (nz), wherever gap i is below zero: not where an event has to come first.
  virtual bool gap_presses(int i, const double* z) const = 0;
  /// Where such a gap is below zero: what presses there, N, before it is cut off where it would pull; damping may leave
  /// nothing of it while the gap opens. Of an element that is not cut off anything above zero.
  virtual double gap_force(int /*i*/, const LocalState& /*s*/) const { return 1; }
  /// The gap that a guard of the element (element/guarded_force.h) is, or -1.
  virtual int gap_of_guard(int guard) const = 0;
  /// Of several gaps whose states begin with one number: appends the states, of the element, that begin with zero in
  /// its place, as their gaps are open at s while others press.
  virtual void add_open_at_start(const LocalState& /*s*/, std::vector<int>& /*states*/) const {}
  /// Whether the element knows where its force bends at touches and while it touches; then it appends by how much the
  /// motion is beyond each such place, as many at every state.
  virtual bool tells_bends() const { return false; }
  virtual void add_bends(const LocalState&, std::vector<double>& /*beyond*/) const {}
};

}  // namespace costate
