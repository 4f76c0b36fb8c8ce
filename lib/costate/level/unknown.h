// One unknown of a system of equations of motion, for messages, norms and files.
#pragma once

#include <string>

namespace costate {

struct Unknown {
  enum class Role { position, velocity, force_state, acceleration, multiplier, stabilizer };
  std::string name;  // "P1.x", "P1.x_dot", "lambda.bar.A1.length"
  std::string unit;
  Role role;
  bool differential;  // its time derivative appears in the system
  /// Whether the unknown takes part in the integrator's norms. Index-2 multipliers do not: their corrections scale with
  /// 1/h of the state's, so that any finite weight spoils the Newton test as the step falls.
  bool in_norm = true;
};

}  // namespace costate
