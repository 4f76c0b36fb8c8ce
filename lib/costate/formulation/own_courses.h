// What forces, constraints and running costs that a user wrote in C++ do by time: their formulas tell nothing of it,
// and where one is zero but for a short pulse no integrator's errors would. Those that ask for the time at all are
// looked at along it, at the start and at a state beside it, as laws without places are (element/course.h).
#pragma once

#include "costate/assembly/assembly.h"
#include "costate/element/course.h"
#include "costate/objective/objective.h"

namespace costate {

/// Whether it is a user's; one that tells its own course (CourseElement) is not to be asked.
bool may_have_own_course(const Element& element);
bool may_have_own_course(const CostTerm& term);

/// With the numbers of the assembly; `start`: (q, v) and, where it is known, z.
void add_own_course(const Element& element, const Assembly& assembly, const StateView& start, Course& course);
void add_own_course(const CostTerm& term, const Assembly& assembly, const StateView& start, Course& course);

}  // namespace costate
