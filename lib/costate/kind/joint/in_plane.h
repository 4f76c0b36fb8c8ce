// [in_plane.NAME]: a point of one body stays in a plane of another (or of the ground).
#pragma once

#include <array>
#include <string>
#include <utility>

#include "costate/mechanism/builder.h"

namespace costate {

/// The second point stays in the plane through the first with this normal, in the frame of the first one's body.
void add_in_plane(MechanismBuilder& builder, const std::string& name, const std::pair<std::string, std::string>& points,
                  const std::array<double, 3>& normal);

}  // namespace costate
