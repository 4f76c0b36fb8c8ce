// Linearized motion about the start of a scene: natural frequencies, damping and mode shapes. At a point (t,
// q, v, z) with its consistent accelerations and multipliers, for directions dq = T(q) x in which a body in
// space has three moves and three turns about the global axes (T = E^T / 2 for its Euler parameters; the
// identity for other coordinates),
//   dq = T x,  dv = T x' + T' x,  da = T x'' + 2 T' x' + T'' x
//   J = Phi_q T,  J' = Phi_q T' + Phid_q T,  J'' = Phi_q T'' + 2 Phid_q T' + Phidd_q T
//   x = R y,  x' = R y' + D y,  x'' = R y'' + 2 D y' + A y,  with R the null space, S = J^+, (5.9)
//   M_y y'' + C_y y' + K_y y - (T R)^T Q_z dz = 0,   dz' = f_q dq + f_v dv + f_z dz    (14.1)
// Where rigid contacts slide, their friction follows the normal force (assembly/friction_rows.h): what takes the
// multipliers out is not R^T then but R_r^T, with R_r the null space of Phi_r T.
// About an equilibrium the eigenvalues are exact. They are about a steady motion, too, where the coefficients
// do not change along it: bodies that move straight on, or spin about an axis of their symmetry. Else they
// belong to the frozen instant. Redundant rows are allowed. Roots may be spread over many orders of magnitude; each is
// zero, or known, by what rounding does to it, whatever the others are (analysis/spread_roots.h). Dense: up to 500
// coordinates.
#pragma once

#include <complex>
#include <string>
#include <vector>

#include "costate/analysis/start.h"
#include "costate/assembly/assembly.h"

namespace costate {

/// A coordinate, or a turn of a body about a global axis ("chassis.turn_y", rad).
struct ModeDirection {
  std::string name, unit;
};

struct Mode {
  std::complex<double> eigenvalue;  // 1/s; of a conjugate pair the one above the real axis
  Eigen::VectorXcd shape, z;        // one entry a direction; nz. The direction that moves most is 1 (or the state)
  Eigen::VectorXd share;            // share of each direction in the kinetic energy of the shape, sum 1 (or 0)
  /// How far, of its size, rounding in masses, stiffness and damping may have moved the eigenvalue; beyond some 1e-3 it
  /// is not known, because it is small against what it is left over from.
  double relative_error = 0;
  bool oscillates() const { return eigenvalue.imag() > 0; }
  double frequency_Hz() const;   // Im / (2 pi)
  double damping_ratio() const;  // -Re / |eigenvalue|
};

struct Modes {
  std::vector<ModeDirection> directions;
  std::vector<Mode> modes;  // by the size of the eigenvalue, without the zeros
  int zero_eigenvalues = 0;
  int degrees_of_freedom = 0;
  // The point: the start, its accelerations and multipliers (of least norm).
  Eigen::VectorXd q, v, z, a, lambda;
  Eigen::VectorXd acceleration;  // one entry a direction: zero in a steady motion
};

/// About `start` at time t. Throws CapabilityError above 500 coordinates.
Modes find_modes(Assembly& assembly, double t, const Start& start);
/// By what part the masses, damping or stiffness in these directions change along the motion, and with time alone, in
/// an instant of 1/|eigenvalue|, of the largest: zero about equilibria and steady motions. Of modes about a point where
/// nothing accelerates; where something does it tells nothing more.
double coefficient_change(Assembly& assembly, double t, const Modes& modes);

}  // namespace costate
