// Rates of accelerations and multipliers along the motion, exact, as the equations of motion, differentiated along it,
// say:
//   KKT [a'; lambda'] = -[R1_q v + R1_v a - Q_z z' + R1_t; R2_q v + R2_v a + R2_t]
// from the elements' templates: drivers, tables and laws count with their explicit dependence on time, nothing is
// differenced.
#pragma once

#include <Eigen/Core>

#include "costate/level/acceleration_level.h"

namespace costate {

/// a' (n) and lambda' (m), one behind the other, at the point that `level` has solved and linearized.
Eigen::VectorXd acceleration_rates(Assembly& assembly, AccelerationLevel& level);

}  // namespace costate
