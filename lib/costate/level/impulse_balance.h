// How a formulation solves for impulses: those of its constraints, where velocities jump.
#pragma once

#include "costate/assembly/assembly.h"

namespace costate {

/// The balance of impulses, [M Phi_q^T; Phi_q -1/alpha], as a formulation solves it.
class ImpulseBalance {
 public:
  virtual ~ImpulseBalance() = default;
  /// Evaluates M, Phi_q and Phi_t of the assembly at (t, q, v, z).
  virtual void prepare(const StateView& s) = 0;
  /// b := the solution for b of n + m entries; as symmetric as the matrix.
  virtual void solve(double* b) = 0;
};

}  // namespace costate
