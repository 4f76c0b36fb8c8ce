// The value of a guard (element/guarded_force.h) at a state of the whole mechanism.
#pragma once

#include "costate/assembly/gathered_state.h"
#include "costate/element/guarded_force.h"

namespace costate {

/// Guard k of a force at (t, q, v, z; lambda where it depends on multipliers, else null), its states beginning at
/// `first_state` among all and its rows at `first_row`, -1 where it has none. `buffer` is for repeated calls.
double guard_value(const Force& force, const GuardedForce& guarded, int k, int first_state, int first_row,
                   const StateView& s, const Assembly& assembly, GatheredState& buffer);

}  // namespace costate
