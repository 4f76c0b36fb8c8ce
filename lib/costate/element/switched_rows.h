// Constraints whose rows come and go: those of a rigid contact are there while it is closed. A state of a force says
// so, so that whoever evaluates them knows, forward and back. A row that is not there is a row of zeros, and its
// multiplier is 0. A contact that slides keeps its gap, row 0; its row 1 keeps nothing, but its multiplier is there, as
// friction: lambda_1 + s mu lambda_0 = 0 with the direction s of sliding, 1 or -1. In space it has two such rows, 1 and
// 2, lambda_k + sigma_k mu lambda_0 = 0 with sigma = w/|w|, w = v_t + o: the rates v_t of both rows and the offset o of
// the states behind sliding_state(), which is 0 unless sliding has begun from rest, where v_t has no direction yet.
#pragma once

#include "costate/element/element.h"

namespace costate {

/// A constraint whose rows are switched derives from this as well.
class SwitchedRows {
 public:
  virtual ~SwitchedRows() = default;
  /// The rows are there where this state, of the force's own, is above 1/2.
  virtual const Force& switched_by() const = 0;
  virtual int switching_state() const = 0;
  /// Whether row i keeps a position once it is there; if not only its rate: it sticks wherever it is.
  virtual bool holds_position(int i) const = 0;
  /// Whether row i is the rate of a function of places; a sphere that rolls has rows J(q) v = 0 that are not: of theirs
  /// phi is 0, phi_q is J, and phidot and phiddot are J v and its rate.
  virtual bool is_integrable(int) const { return true; }
  /// Whether row i has a place that the start is to meet, or sticks where it is given.
  virtual bool has_place(int i) const { return is_integrable(i); }
  /// d/dt J - (J v)_q of these rows at (q, v), 0 of the others; rows x coordinates, zero on entry.
  virtual void calc_twist(const LocalState&, LocalMatrix&) const {}
  /// Of one that may slide: the state of the force's own that holds s, or 0 where it does not; and mu among all
  /// numbers.
  virtual int sliding_state() const { return -1; }
  virtual int friction_number() const { return -1; }
};

inline bool has_switched_rows(const Constraint& c) { return dynamic_cast<const SwitchedRows*>(&c) != nullptr; }

}  // namespace costate
