// Time derivatives along the motion of the matrices that second-order adjoints need: Mdot, Mddot, Cdot (C = -Q_v) and
// d(f_v)/dt, and of the equations themselves, which give the rates of accelerations and multipliers. They come from the
// elements' templated physics on path duals (exact), not from hand-written kernels.
#pragma once

#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

struct PathRates {
  std::vector<double> M_dot, M_ddot, C_dot;  // on the square pattern
  std::vector<double> f_v_dot;               // on the state_force pattern
};

/// At (t, q, v, a, z) with zdot from the last dynamics; numbers are those of the assembly.
void calc_path_rates(Assembly& assembly, const StateView& s, PathRates& out);

/// How the equations change along the motion apart from a' and lambda', after calc_partials() at s (q, v, a, lambda,
/// z):
///   force (n) = R1_q v + R1_v a - Q_z z' + R1_t,   row (m) = the third time derivative of Phi at a' = 0,
/// the explicit dependence on time included.
void calc_motion_rates(Assembly& assembly, const StateView& s, double* force, double* row);

}  // namespace costate
