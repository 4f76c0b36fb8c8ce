// What forces, constraints and running costs that a user wrote in C++ do by time (objective/own_value.h): where one is
// zero but for a short pulse no integrator's errors would tell. Those that ask for the time at all are looked at along
// it, at the start and at a state beside it, as laws without places are (element/course.h); what they do along the
// motion is looked at behind each step (event/path_watch.h).
#pragma once

#include "costate/assembly/assembly.h"
#include "costate/element/course.h"
#include "costate/objective/own_value.h"

namespace costate {

/// With the numbers of the assembly; `start`: (q, v) and, where it is known, z.
void add_own_course(const OwnValue& value, Assembly& assembly, const StateView& start, Course& course);

}  // namespace costate
