// What an element says of itself, as it is added to a mechanism: indices that there are, and of a constraint whether it
// depends on time where it says that it does not. Elements of one's own come without the readers of scenes.
#pragma once

#include "costate/mechanism/mechanism.h"

namespace costate {

/// Throws ModelError at the element's path: of coordinates and numbers that the mechanism does not have.
void check_element(const Mechanism& mechanism, const Element& element);
/// The same, and of a phi that changes with time by itself though the constraint is not rheonomic(): phi_t and phi_tt
/// are not asked for then, and every formulation would have another motion.
void check_element(const Mechanism& mechanism, const Constraint& constraint);
/// The same, and of a state that starts with a number that the force does not have.
void check_element(const Mechanism& mechanism, const Force& force);

}  // namespace costate
