// What forces, constraints and running costs that a user wrote in C++ come to at a state, as one number, for who looks
// for what they do along time or along a motion: their formulas tell nothing of it.
#pragma once

#include <functional>

#include "costate/assembly/assembly.h"
#include "costate/objective/objective.h"

namespace costate {

/// A sum of different parts of each entry (forces and rates of states, what time does to a constraint's rate and second
/// derivative), so that nothing is lost in it; with the numbers of the assembly. No number where a formula says
/// nothing.
using OwnValue = std::function<double(const StateView& s, Assembly& assembly)>;

/// Whether it is a user's, so that there is something to look for, and does not tell its course itself (CourseElement).
bool is_own(const Element& element);
bool is_own(const CostTerm& term);

/// Null of elements that are neither a force nor a constraint that changes with time.
OwnValue own_value(const Mechanism& mechanism, const Element& element);
OwnValue own_value(const CostTerm& term);

/// Whether it asks for the time at this state: no number in the time's place comes out as none, or is compared with
/// one, which says so by FE_INVALID.
bool asks_for_time(const OwnValue& value, StateView s, Assembly& assembly);

}  // namespace costate
