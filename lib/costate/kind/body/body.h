// [body.NAME]: a rigid body of the plane, with the coordinates NAME.x, NAME.y, NAME.angle of its reference
// point and frame. Points are fixed to it by [point.*] with on = "NAME"; its angle goes by the name NAME.
#pragma once

#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

struct BodyOptions {
  double mass_kg = 0;
  double inertia_kg_m2 = 0;               // about the centre of mass
  double center_x_m = 0, center_y_m = 0;  // centre of mass in the body's frame
  // Start values, or first guesses where the start does not give them.
  double x_m = 0, y_m = 0, angle_rad = 0;
  double vx_m_per_s = 0, vy_m_per_s = 0, angular_velocity_rad_per_s = 0;
};
void add_body(MechanismBuilder& builder, const std::string& name, const BodyOptions& options);

}  // namespace costate
