// [rotor.NAME]: a wheel or flywheel that spins about an axis of a rigid body; coordinate NAME.spin_angle.
#pragma once

#include <array>
#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

struct RotorOptions {
  std::array<double, 3> axis = {0, 1, 0};  // in the body's frame
  double inertia_kg_m2 = 0;                // about the axis; the body holds mass and transverse moments
  double angle_rad = 0;
  double spin_rad_per_s = 0;  // against the body
};
void add_rotor(MechanismBuilder& builder, const std::string& name, const std::string& on, const RotorOptions& options);

}  // namespace costate
