// Linearized motion about the start of a scene: natural frequencies, damping and mode shapes. At a point (t, q, v, z) with
// its consistent accelerations and multipliers, with R = N the null space of Phi_q, S = Phi_q^+ and (5.9),
//   dq = R y,  dv = R y' + D y,  da = R y'' + 2 D y' + A y
//   M_z y'' + C_z y' + K_z y - R^T Q_z dz = 0,   dz' = f_q dq + f_v dv + f_z dz                            (14.1)
// whose eigenvalues are those of the mechanism with its constraints, redundant ones included. About an equilibrium they are
// exact; about a steady motion, too, if the coefficients do not change along it; else they belong to the frozen instant.
// Zero eigenvalues (rigid motions, a wheel that spins freely) are split off before the others are computed, because those
// of a chain of them would come out as large as the square root of rounding. Dense: up to 500 coordinates.
#pragma once

#include <complex>
#include <vector>

#include "costate/analysis/start.h"
#include "costate/assembly/assembly.h"

namespace costate {

struct Mode {
  std::complex<double> eigenvalue;  // 1/s; of a conjugate pair the one above the real axis
  Eigen::VectorXcd q, z;            // n, nz: the shape; the coordinate that moves most is 1 (without one, the state)
  Eigen::VectorXd share;            // n: share of each coordinate in the kinetic energy of the shape, sum 1 (or 0)
  bool oscillates() const { return eigenvalue.imag() > 0; }
  double frequency_Hz() const;   // Im / (2 pi)
  double damping_ratio() const;  // -Re / |eigenvalue|
};

struct Modes {
  std::vector<Mode> modes;  // by the size of the eigenvalue, without the zeros
  int zero_eigenvalues = 0;
  int degrees_of_freedom = 0;
  // The point: the start, its accelerations and multipliers (of least norm).
  Eigen::VectorXd q, v, z, a, lambda;
};

/// About `start` at time t. Throws CapabilityError above 500 coordinates.
Modes find_modes(Assembly& assembly, double t, const Start& start);

}  // namespace costate
