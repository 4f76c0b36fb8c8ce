// [angle.NAME]: an angle coordinate NAME.angle for a bar or for the line between two points, which counts
// full turns. Springs, couples and drivers act on it by the name NAME.
#pragma once

#include <optional>
#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

struct AngleOptions {
  std::optional<double> angle_rad = {};  // start value or first guess; default: of the first positions, in (-pi, pi]
  double angular_velocity_rad_per_s = 0;
};
void add_angle(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
               const AngleOptions& options);
void add_bar_angle(MechanismBuilder& builder, const std::string& name, const std::string& bar,
                   const AngleOptions& options);

}  // namespace costate
