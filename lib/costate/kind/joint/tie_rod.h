// [tie_rod.NAME]: a massless rod to a point that slides in a body along a direction, by a coordinate (the displacement
// of a steering rack).
#pragma once

#include <array>
#include <optional>
#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

struct TieRodOptions {
  std::string from;                             // the sliding end: where it is at displacement zero
  std::string to;                               // the other end
  std::string slide;                            // coordinate of the displacement [m]
  std::array<double, 3> direction = {0, 1, 0};  // of the slide, in the frame of from's body
  std::optional<double> length_m = {};          // none: that of the start
};
void add_tie_rod(MechanismBuilder& builder, const std::string& name, const TieRodOptions& options);

}  // namespace costate
