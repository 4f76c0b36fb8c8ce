// The state of the mechanism at samples. Systems whose unknowns hold accelerations or multipliers take them from there
// in mechanism_state(), which costs and their gradients refer to. Of an interpolated y they are not solutions:
// integrators control the error of neither, and between steps they may be anything. Such systems solve for them here.
#pragma once

#include "costate/formulation/system.h"

namespace costate {

class SolvedState {
 public:
  virtual ~SolvedState() = default;
  /// As mechanism_state(), but accelerations and multipliers are those of the formulation's equations at the (t, q, v,
  /// z) of y.
  virtual MechanismState solved_state(double t, const double* y) = 0;
  /// The same for accelerations among y's own unknowns, for adjoints, which linearize about what is between an
  /// integrator's steps. For those whose integrators keep them true there is nothing to do.
  virtual void solve_unknowns(double, double*) {}
};

inline MechanismState solved_state(System& system, double t, const double* y) {
  auto* solving = dynamic_cast<SolvedState*>(&system);
  return solving ? solving->solved_state(t, y) : system.mechanism_state(t, y);
}

/// For a look within a step (System::look_state), or with accelerations and multipliers, too.
inline MechanismState look_state(System& system, double t, const double* y, bool solved) {
  return solved ? solved_state(system, t, y) : system.look_state(t, y);
}

}  // namespace costate
