// Forces whose motion has events: a foot that touches, a stop that lets go. An event happens where a guard crosses
// zero; the force's own states then jump (what it has latched: an approach speed, a mode), and everything else goes on.
// The mode of a force is among its states, so that whoever evaluates it knows the mode, forward and back.
#pragma once

#include <string>

#include "costate/element/element.h"

namespace costate {

/// A force that has events derives from this as well.
class GuardedForce {
 public:
  virtual ~GuardedForce() = default;

  virtual int guard_count() const = 0;
  virtual std::string guard_name(int k) const = 0;  // "touch"
  /// What the force is in behind event k: "closed".
  virtual std::string mode_behind(int k) const = 0;
  /// +1 where guard k counts as it rises through zero, -1 as it falls.
  virtual int guard_direction(int k) const = 0;
  /// Whether guard k is looked at with these states (nz).
  virtual bool guard_armed(int k, const double* z) const = 0;
  /// h_k(t, q, v, z, p); accelerations and multipliers are not given.
  /// NaN where it is not looked at.
  virtual PathDual guard(int k, const MeasureArguments& x) const = 0;
  /// Its value alone, which is asked for several times a step.
  virtual double guard_value(int k, const LocalState& s) const = 0;
  /// What to do where guard k is past zero when a run starts; empty where that is as it may be.
  virtual std::string past_at_start(int k) const = 0;
  /// Of event k, for what else happens in its instant: whether the force jumps there, and whether what is latched
  /// depends on velocities, which forces change.
  virtual bool force_jumps(int /*k*/) const { return false; }
  virtual bool latches_speed(int /*k*/) const { return false; }
  /// The states behind event k, nz of them, from everything before it.
  virtual void transition(int k, const MeasureArguments& x, PathDual* z_after) const = 0;
};

}  // namespace costate
