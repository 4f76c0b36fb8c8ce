// The cost at the end, w(q, v, z, a, lambda, rho), where a and lambda are those that the equations of the formulation
// give at (q, v, z): w^ of lib/README.md (0.8), a function of (q, v, z) and rho alone.
#pragma once

#include "costate/level/acceleration_level.h"
#include "costate/objective/output.h"

namespace costate {

/// The gradient g of w at the state s that `level` has solved and linearized becomes that of w^: g.q, g.v, g.z change,
/// and gradient += c (w^_rho - w_rho), unless null. Returns (t1, t2).
Eigen::VectorXd eliminate_at_end(AccelerationLevel& level, Assembly& assembly, const StateView& s, ScalarGradient& g,
                                 double c, double* gradient);

}  // namespace costate
