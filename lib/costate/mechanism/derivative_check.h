// Derivatives that an element writes by hand, held against those that its own physics gives by dual numbers: every
// formulation and method asks the same block, so that all of them would agree on a gradient that is wrong.
#pragma once

#include "costate/mechanism/mechanism.h"

namespace costate {

enum class ElementsChecked {
  of_users,  // whose classes are not of namespace costate: these are held against dual numbers by its tests
  all,
};

/// Throws ModelError at an element's path, with the block, its entry and both values: where a block that its class
/// overrides is not the derivative of its residual(), phi() or force(); where a mass or force is said to be constant
/// and is not; where it acts within its region of rest. Of each class eight elements are looked at, each in two states
/// near the start, velocities and multipliers of order one; a state that the element refuses tells nothing.
/// Allowed: 1e-6 of an entry, 1e-13 of the largest entry of its row in all blocks, and 1e-15 of the largest number,
/// which is rounding: a damping beside a stiffness 1e10 times as large can be wrong unseen, as can what acts elsewhere
/// only.
void check_derivatives(const Mechanism& mechanism, ElementsChecked which = ElementsChecked::of_users);

}  // namespace costate
