// Compliant contact of points, arcs or spheres with the ground (element/force/contact.h).
#pragma once

#include <string>
#include <vector>

#include "costate/mechanism/builder.h"

namespace costate {

struct ContactOptions {
  std::string law = "hunt-crossley";                  // element/force/contact_laws.h
  double stiffness_N_per_m_n = 0;                     // K of F = K d^n; with a modulus that of Hertz, 4/3 E* sqrt(R)
  double youngs_modulus_Pa = 0, poisson_ratio = 0.3;  // of what has the radius; 0: the stiffness as given
  double ground_youngs_modulus_Pa = 0, ground_poisson_ratio = 0.3;  // 0: the ground is rigid
  double exponent = 1.5;                                            // n; linear has 1
  double restitution = 0.5;                                         // of the laws that have one
  double damping_N_s_per_m = 0;                                     // of kelvin-voigt
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
  double rolling_resistance_m = 0;  // the arm of the moment against rolling; of what has a radius
  double spinning_resistance_m = 0;
  double turning_transition_rad_per_s = 0.1;  // where these moments are fully there
  double approach_speed_m_per_s = 0;          // of a contact that is closed at the start
  std::vector<double> shares;                 // of the normal law, one a point; empty: 1 each
  std::string ahead_of;                       // it closes only where it is ahead of this point; empty: everywhere
  bool energy_lost = false;                   // whether that is integrated
};

/// Several points are on one rigid body. Throws ModelError at contact.NAME.KEY: unknown laws, numbers out of range, a
/// radius of what does not turn.
void add_contact(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& points,
                 const ContactOptions& o);

}  // namespace costate
