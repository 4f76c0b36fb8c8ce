// Compliant contact of two round bodies with each other (element/force/contact_pair.h).
#pragma once

#include <string>

#include "costate/kind/contact/contact_numbers.h"

namespace costate {

struct ContactPairOptions : ContactLawOptions {
  double radius_m = 0, other_radius_m = 0;
};

/// Between the points `point` and `other`, both of the plane or both of space, on different bodies. Throws ModelError
/// at contact_pair.NAME.KEY: unknown laws, numbers out of range, radii of what does not turn, bristles in space.
void add_contact_pair(MechanismBuilder& builder, const std::string& name, const std::string& point,
                      const std::string& other, const ContactPairOptions& o);

}  // namespace costate
