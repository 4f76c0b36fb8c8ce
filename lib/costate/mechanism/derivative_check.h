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
/// and is not; where it acts within its region of rest. Of each class two elements are looked at, each in two states
/// near the start, velocities and multipliers of order one; a state that the element refuses tells nothing.
/// Allowed: 1e-6 of the block's largest entry, and 1e-12 of the element's largest, which is rounding.
void check_derivatives(const Mechanism& mechanism, ElementsChecked which = ElementsChecked::of_users);

}  // namespace costate
