// [path_driver.NAME]: a driver who steers a vehicle along a path y(x), by preview.
#pragma once

#include <string>

#include "costate/kind/law/law_options.h"

namespace costate {

struct PathDriverOptions {
  std::string point;       // of the vehicle, which drives along its body's x axis, z up
  std::string coordinate;  // of the steering [m]; positive steers to the right
  LawOptions path;         // y [m] over x [m]
  double gain = 0;         // steering a metre of lateral error seen ahead [1]
  double yaw_gain_m_s_per_rad = 0;
  double preview_m = 0;
  double decision_lag_s = 0.1, arm_lag_s = 0.1;
  double stiffness_N_per_m = 0, damping_N_s_per_m = 0;  // between arm and steering
  double initial_command_m = 0, initial_steering_m = 0;
};
void add_path_driver(MechanismBuilder& builder, const std::string& name, const PathDriverOptions& options);

}  // namespace costate
