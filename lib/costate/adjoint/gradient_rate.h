// The time derivative of a running cost's gradient along the motion, exact: what the end of the index-3
// adjoint and second-order adjoints need of the cost. With the rates of accelerations and multipliers
// (level/acceleration_rates.h)
//   (g_x)' = g_xq v + g_xv a + g_xa a' + g_xlambda lambda' + g_xz z' + g_xt,
// from the elements' and the costs' templates: tables and target laws count with their explicit dependence on time,
// nothing is differenced.
#pragma once

#include "costate/level/acceleration_level.h"
#include "costate/objective/objective.h"

namespace costate {

/// out = (g_q)', (g_v)', ... there; `out` has been sized. Throws CapabilityError for costs without second
/// derivatives.
void calc_running_gradient_rate(const Objective& objective, Assembly& assembly, AccelerationLevel& level,
                                ScalarGradient& out);

/// The same at a point s that the assembly has evaluated (z' is there), for costs that need no accelerations: without
/// a' and lambda'.
void calc_running_gradient_rate(const Objective& objective, Assembly& assembly, const StateView& s,
                                ScalarGradient& out);

}  // namespace costate
