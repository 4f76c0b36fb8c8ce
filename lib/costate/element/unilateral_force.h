// Rigid contacts: forces whose events are impacts. Where a gap closes velocities jump so that it does not become
// negative; with the rows r_i(q) of a contact, its gap first and then the place along the ground, v+ follows from
// r_i' behind the impact = -e r_i' before it (lib/README.md (19)). A contact that comes to rest closes: its rows are
// constraints from there on (element/switched_rows.h), until the ground would have to pull.
#pragma once

#include "costate/element/guarded_force.h"

namespace costate {

class UnilateralForce : public GuardedForce {
 public:
  /// What guard k is: the gap that closes; of a contact that is closed the normal force that vanishes, the friction
  /// force that reaches its limit, as it begins to slide forward or backward, and the sliding that ends.
  enum class Guard { touch, release, slip_forward, slip_backward, stop };
  virtual Guard guard_kind(int k) const = 0;
  bool force_jumps(int k) const override { return guard_kind(k) == Guard::touch; }
  bool latches_speed(int k) const override { return guard_kind(k) == Guard::touch; }
  /// r_i(q, p), i < row_count(): the gap, then, where it may stick, the place along the ground.
  virtual int row_count() const = 0;
  virtual PathDual row(int i, const MeasureArguments& x) const = 0;
  virtual DirectedPathDual row_directed(int i, const DirectedPathDual* q, const DirectedPathDual* p) const = 0;
  /// Numbers of the element's own: restitution, friction coefficient, and the approach speed below which it closes.
  virtual int restitution_number() const = 0;
  virtual int friction_number() const = 0;
  /// The coefficient up to which it sticks: that of sliding, or a larger one, and friction falls as sliding begins.
  virtual int sticking_number() const { return friction_number(); }
  virtual int closing_speed_number() const = 0;
  /// Whether restitution is Poisson's, of impulses, not Newton's, of speeds.
  virtual bool gives_impulse_back() const = 0;
  /// The state that says whether it is closed, 0 or 1; -1 where it never is. Its rows are then those of the constraint.
  virtual int closed_state() const = 0;
  /// The state that holds the direction in which it slides, 1 or -1, or 0 where it sticks; -1 without friction.
  virtual int sliding_state() const = 0;
  virtual const Constraint* rows() const = 0;
};

}  // namespace costate
