// The guards of a mechanism's events, one by one: for those who look for the end of a step at an event on their own.
#pragma once

#include "costate/assembly/gathered_state.h"
#include "costate/element/guarded_force.h"

namespace costate {

/// The guard of an event, numbered as in event/motion_events.h, at (t, q, v, z; lambda where it depends on multipliers,
/// else null): zero where it happens.
double guard_value(int event, const StateView& s, const Assembly& assembly);

/// The same, but that where a slip in space ends it is negative as long as w points back from where it points at
/// `begin`: |w| is no less than zero.
double guard_value_from(int event, const StateView& begin, const StateView& s, const Assembly& assembly);

/// The same of the force's own guard k, its states beginning at `first_state` among all and its rows at `first_row`, -1
/// where it has none. `buffer` is for repeated calls.
double guard_value(const Force& force, const GuardedForce& guarded, int k, int first_state, int first_row,
                   const StateView& s, const Assembly& assembly, GatheredState& buffer);

}  // namespace costate
