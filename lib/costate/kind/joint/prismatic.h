// [prismatic.NAME]: a sliding joint between two bodies, or a body and the ground, by a point on each. Between points of
// space it takes the keys of [translational.NAME] and is one.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "costate/mechanism/builder.h"

namespace costate {

/// The second point slides along an axis through the first, and the two bodies keep their relative angle.
struct PrismaticOptions {
  double axis_angle_rad = 0;                      // of the axis in the frame of the first point's body
  std::optional<double> relative_angle_rad = {};  // second body to first; default: that of the start values
};
void add_prismatic(MechanismBuilder& builder, const std::string& name,
                   const std::pair<std::string, std::string>& points, const PrismaticOptions& options);

}  // namespace costate
