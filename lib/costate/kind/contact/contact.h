// Compliant contact of a point, an arc or a sphere with the ground (element/force/contact.h).
#pragma once

#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

struct ContactOptions {
  std::string law = "hunt-crossley";  // element/force/contact_laws.h
  double stiffness_N_per_m_n = 0;     // K of F = K d^n
  double exponent = 1.5;              // n; linear has 1
  double restitution = 0.5;           // of the laws that have one
  double damping_N_s_per_m = 0;       // of kelvin-voigt
  std::string friction = "none";
  double friction_coefficient = 0;  // of sliding
  double static_coefficient = -1;   // negative: that of sliding
  double transition_velocity_m_per_s = 0.01;
  double dead_velocity_m_per_s = 0;      // ambrosio
  double decay_s_per_m = 10;             // bengisu-akay
  double bristle_stiffness_per_m = 1e4;  // dahl, lugre: N sigma is a stiffness
  double bristle_damping_s_per_m = 0;    // lugre
  double ground_height_m = 0, ground_angle_rad = 0;
  double radius_m = 0;
  double approach_speed_m_per_s = 0;  // of a contact that is closed at the start
};

/// Throws ModelError at contact.NAME.KEY: unknown laws, numbers out of range, a radius of what does not turn.
void add_contact(MechanismBuilder& builder, const std::string& name, const std::string& point, const ContactOptions& o);

}  // namespace costate
