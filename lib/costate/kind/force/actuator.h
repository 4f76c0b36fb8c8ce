// [actuator.NAME]: a force between two points, or a torque on one angle or between two, that follows a
// command in time with a first-order lag: F = z, zdot = (command(t) - z) / tau. A force pulls the points
// together for F > 0, as a spring's does; a torque turns the (second) angle forward, as a couple's does.
#pragma once

#include <string>
#include <vector>

#include "costate/kind/law/law_options.h"

namespace costate {

/// The numbers of the lag, in the order in which its laws have them: tau, and the force or torque at the start.
std::vector<int> add_lag_numbers(MechanismBuilder& builder, const std::string& path, double time_constant_s,
                                 const char* initial_key, double initial);

struct ActuatorOptions {
  double time_constant_s = 0;
  double initial_force_N = 0;
  LawOptions command_N = {};  // of time
  bool work = false;          // whether the work done is integrated, the output NAME.work
};
void add_actuator(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
                  const ActuatorOptions& options);

struct RotaryActuatorOptions {
  double time_constant_s = 0;
  double initial_torque_N_m = 0;
  LawOptions command_N_m = {};  // of time
  bool work = false;
};
void add_rotary_actuator(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                         const RotaryActuatorOptions& options);

}  // namespace costate
