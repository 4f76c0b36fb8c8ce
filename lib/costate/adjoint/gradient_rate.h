// The time derivative of a running cost's gradient along the motion, exact: what the end of the index-3
// adjoint and second-order adjoints need of the cost. Accelerations and multipliers change as the equations
// of motion, differentiated along the motion, say:
//   KKT [a'; lambda'] = -[R1_q v + R1_v a - Q_z z' + R1_t; R2_q v + R2_v a + R2_t]
// and (g_x)' = g_xq v + g_xv a + g_xa a' + g_xlambda lambda' + g_xz z' + g_xt, from the elements' and the
// costs' templates: drivers, tables and target laws count with their explicit dependence on time, nothing is
// differenced.
#pragma once

#include "costate/level/acceleration_level.h"
#include "costate/objective/objective.h"

namespace costate {

/// a' (n) and lambda' (m), one behind the other, at the point that `level` has solved and linearized.
Eigen::VectorXd acceleration_rates(Assembly& assembly, AccelerationLevel& level);

/// out = (g_q)', (g_v)', ... there; `out` has been sized. Throws CapabilityError for costs without second
/// derivatives.
void calc_running_gradient_rate(const Objective& objective, Assembly& assembly, AccelerationLevel& level,
                                ScalarGradient& out);

/// The same at a point s that the assembly has evaluated (z' is there), for costs that need no accelerations: without
/// a' and lambda'.
void calc_running_gradient_rate(const Objective& objective, Assembly& assembly, const StateView& s,
                                ScalarGradient& out);

}  // namespace costate
