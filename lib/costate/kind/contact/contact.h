// Compliant contact of points, arcs or spheres with the ground (element/force/contact.h).
#pragma once

#include <string>
#include <vector>

#include "costate/kind/contact/contact_ground.h"
#include "costate/kind/contact/contact_numbers.h"
#include "costate/mechanism/builder.h"

namespace costate {

struct ContactOptions : ContactLawOptions {
  double ground_x_m = 0, ground_height_m = 0, ground_angle_rad = 0;  // goes through (x, height)
  double radius_m = 0;
  double rolling_resistance_m = 0;  // the arm of the moment against rolling; of what has a radius
  double spinning_resistance_m = 0;
  double turning_transition_rad_per_s = 0.1;  // where these moments are fully there
  std::vector<double> shares;                 // of the normal law, one a point; empty: 1 each
  std::string ahead_of;                       // it closes only where it is ahead of this point; empty: everywhere
  ContactGroundOptions ground;
};

/// Several points are on one rigid body. Throws ModelError at contact.NAME.KEY: unknown laws, numbers out of range, a
/// radius of what does not turn, a ground that is not there.
void add_contact(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& points,
                 const ContactOptions& o);

}  // namespace costate
