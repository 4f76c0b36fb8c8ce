// The guards of a mechanism's events, one by one: for those who look for the end of a step at an event on their own.
#pragma once

#include "costate/assembly/assembly.h"

namespace costate {

/// The guard of an event, numbered as in event/motion_events.h, at (t, q, v, z; lambda where it depends on multipliers,
/// else null): zero where it happens.
double guard_value(int event, const StateView& s, const Assembly& assembly);

}  // namespace costate
