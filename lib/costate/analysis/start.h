// The consistent start: positions and velocities from the given coordinates and the constraints, with their exact
// derivative with respect to the parameters (a bar's length moves the start; forgetting this is the classic error).
//   [Phi; B q - z0] = 0, [Phi_q; B] v = [-Phi_t; zd0]
//   [Phi_q; B] Sq = [-Phi_rho; z0_rho], [Phi_q; B] Sv = [-(Phid_rho + Phid_q Sq); zd0_rho]
// Redundant constraints are allowed as long as they are consistent.
// A mechanism that starts at equilibrium (Mechanism::starts_at_equilibrium) gives fewer positions; balance finds the
// others and the force states (analysis/equilibrium.h). Where all given velocities are zero and no driver moves it
// starts at rest, and no more velocities need be given.
#pragma once

#include "costate/assembly/assembly.h"

namespace costate {

struct Start {
  Eigen::VectorXd q, v, z;              // n, n, nz
  Eigen::MatrixXd q_rho, v_rho, z_rho;  // n x np, n x np, nz x np (empty unless asked for)
  int iterations = 0;
  // Of a start at equilibrium: the multipliers there, by which nothing accelerates at v = 0 (not those of the run at
  // v), with their derivative (m, m x np); and whether the velocities are zero because nothing is said to move.
  Eigen::VectorXd lambda;
  Eigen::MatrixXd lambda_rho;
  bool rests = false;
  std::vector<int> open_states;  // those that begin with zero as their gaps are open (element/gap_element.h)

  /// (q, v, z) at time t, without accelerations and multipliers; valid as long as these are.
  StateView state(double t) const { return {t, q.data(), v.data(), nullptr, nullptr, z.data()}; }
};

/// At time t for the parameters that the assembly holds. Throws ModelError for too few or too many given
/// coordinates and for positions that cannot be reached (naming the worst constraints).
Start find_start(Assembly& assembly, double t, bool with_derivatives);

/// What a run needs of the start's derivative: nothing, its columns, or what add_start_gradient takes, which is without
/// columns but where the start is an equilibrium.
enum class StartDerivative { none, columns, adjoint };
bool needs_start_columns(const Assembly& assembly, StartDerivative wanted);
/// gradient += w_q^T q_rho + w_v^T v_rho + w_z^T z_rho, for weights of length n, n, nz: by one transposed solution of
/// each of the start's systems, or by its columns where it has them. In analysis/start_adjoint.cpp.
void add_start_gradient(Assembly& assembly, double t, const Start& start, const double* w_q, const double* w_v,
                        const double* w_z, double* gradient);

/// Initial values of the force states as the numbers have them (nz), and their derivative (nz x np) unless null.
void calc_initial_states(const Assembly& assembly, Eigen::VectorXd& z, Eigen::MatrixXd* z_rho);

/// Coordinates less independent constraint rows. The start requires one given position for each, so that this is their
/// number; a mechanism that starts at equilibrium is asked there (at t = 0).
int degrees_of_freedom(Assembly& assembly);

/// What the constraints leave free, and which of them say nothing new.
struct ConstraintRank {
  int rank = 0;
  std::vector<int> dependent_rows;  // global rows that depend on the others
};
ConstraintRank constraint_rank(Assembly& assembly, double t, const double* q);

}  // namespace costate
