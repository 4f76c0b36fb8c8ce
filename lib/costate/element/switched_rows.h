// Constraints whose rows come and go: those of a rigid contact are there while it is closed. A state of a force says
// so, so that whoever evaluates them knows, forward and back. A row that is not there is a row of zeros, and its
// multiplier is 0.
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
};

}  // namespace costate
