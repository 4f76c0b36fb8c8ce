// The ground of a contact where it is no plane at rest: a road on it, or a body that carries it.
#pragma once

#include <string>

#include "costate/element/force/contact.h"
#include "costate/mechanism/builder.h"

namespace costate {

struct ContactGroundOptions {
  std::string road;         // [road.NAME]: its height counts from the plane, along its normal; empty: none
  std::string ground_body;  // a body of the plane that carries the plane, and the road on it; empty: it is at rest
  /// Whether there is any.
  bool any() const { return !road.empty() || !ground_body.empty(); }
};

/// Throws ModelError at PATH.road and PATH.ground_body: unknown names, a body in space, the body of the point itself; a
/// profile that has a kink under what is round.
ContactGround find_contact_ground(const MechanismBuilder& builder, const std::string& path,
                                  const ContactGroundOptions& options, const std::vector<int>& point_coordinates,
                                  bool round, bool space);

}  // namespace costate
