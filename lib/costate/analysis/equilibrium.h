// Static equilibrium: positions, force states and multipliers at which everything rests,
//   Phi_q^T lambda + B^T held - Q(t, q, v = 0, z) = 0,   Phi(q, t) = 0,   B q = b,   f(t, q, 0, z) = 0 (0.10)
// where B selects positions that are held (`held` is what holding them takes), with its exact derivative with
// respect to the parameters: a softer spring lets the mechanism rest lower, and a run that starts there
// starts lower. Redundant constraints are allowed; the multipliers are those of least norm.
//
// Newton's method on the null space of [Phi_q; B], with the multipliers eliminated by least squares. Where
// the reduced stiffness is not positive definite (far away, or near an equilibrium that is not stable) the
// masses are added to it until it is: a step of implicit Euler on M q' = Q, which runs down to a stable
// equilibrium.
#pragma once

#include <string>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

/// A coordinate that keeps `value`; `number` (or -1) is the number of the mechanism that it follows.
struct HeldPosition {
  int coordinate = -1;
  double value = 0;  // m, rad or 1
  int number = -1;
};

/// The positions that [start] gives, at the values that the assembly's parameters give them.
std::vector<HeldPosition> held_by_start(const Assembly& assembly);

struct Equilibrium {
  Eigen::VectorXd q, z, lambda;  // n, nz, m
  Eigen::VectorXd held;          // generalized force by which a held position is kept, one a held position [N, N m]
  int iterations = 0;
  double residual = 0;             // largest unbalanced generalized force [N, N m]
  double constraint_residual = 0;  // largest |Phi|
  /// Smallest eigenvalue of the reduced stiffness in the metric of the masses [1/s^2], its real part where the
  /// stiffness is not symmetric: negative for an equilibrium that is not stable (force states eliminated; what damping
  /// or states make grow is a matter of modes). 0 without a degree of freedom.
  double lowest_stiffness = 0;
  int degrees_of_freedom = 0;                          // that balance alone determines
  Eigen::MatrixXd q_rho, z_rho, lambda_rho, held_rho;  // n, nz, m, held x np (empty unless asked for)
};

/// First guesses other than the scene's (continuation): n and nz numbers.
struct EquilibriumGuess {
  Eigen::VectorXd q, z;
};

/// At time t for the parameters that the assembly holds. Throws ModelError where the constraints cannot be
/// closed, where no equilibrium is found, and where nothing determines a coordinate (which it names).
Equilibrium find_equilibrium(Assembly& assembly, double t, const std::vector<HeldPosition>& held, bool with_derivatives,
                             const EquilibriumGuess* guess = nullptr);

/// Multipliers of the balance, of f = 0 and of Phi = 0 (s, w, x with n, nz, m entries) that carry weights of
/// q and z through the equilibrium: with X = [Phi_q; B], free force states alone in w, and K, Q_z, f at rest,
///   K^T s + f_q^T w + X^T [x; .] = weight_q,   -Q_z^T s + f_z^T w = weight_z,   X s = 0
struct EquilibriumAdjoint {
  Eigen::VectorXd s, w, x;
};
EquilibriumAdjoint equilibrium_adjoint(Assembly& assembly, double t, const Eigen::VectorXd& q, const Eigen::VectorXd& z,
                                       const Eigen::VectorXd& weight_q, const Eigen::VectorXd& weight_z);

class Output;

/// An output's value at rest, and its derivative with respect to the parameters (np; needs those of e).
double value_at_rest(const Output& output, Assembly& assembly, double t, const Equilibrium& e);
Eigen::VectorXd derivative_at_rest(const Output& output, Assembly& assembly, double t, const Equilibrium& e);

}  // namespace costate
