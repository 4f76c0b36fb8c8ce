// Couplings of coordinates: [gear.NAME], two angles turn in a ratio; [rack_and_pinion.NAME], a way is a
// radius times an angle; [screw.NAME], a way is a lead times the turns of an angle. Angles are those of
// planar bodies, of [angle.*] and of joints; ways are any coordinates in m: POINT.x, BODY.y,
// RACK.displacement.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "costate/mechanism/builder.h"

namespace costate {

/// second = ratio first + offset: the second turns `ratio` times as fast; negative for gears that mesh
/// outside. Default offset: that of the start values (or first guesses).
void add_gear(MechanismBuilder& builder, const std::string& name, const std::pair<std::string, std::string>& angles,
              double ratio, std::optional<double> offset_rad = {});
/// coordinate = radius angle + offset.
void add_rack_and_pinion(MechanismBuilder& builder, const std::string& name, const std::string& angle,
                         const std::string& coordinate, double radius_m, std::optional<double> offset_m = {});
/// coordinate = lead angle / (2 pi) + offset; a positive lead is a right-handed thread.
void add_screw(MechanismBuilder& builder, const std::string& name, const std::string& angle,
               const std::string& coordinate, double lead_m_per_turn, std::optional<double> offset_m = {});

}  // namespace costate
