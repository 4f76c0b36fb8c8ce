// Conditions between two lines, each through two points: [parallel.NAME], [perpendicular.NAME], and
// [slot.NAME], a point that stays on a line.
#pragma once

#include <string>
#include <utility>

#include "costate/mechanism/builder.h"

namespace costate {

using PointPair = std::pair<std::string, std::string>;

void add_parallel(MechanismBuilder& builder, const std::string& name, const PointPair& first, const PointPair& second);
void add_perpendicular(MechanismBuilder& builder, const std::string& name, const PointPair& first,
                       const PointPair& second);
void add_slot(MechanismBuilder& builder, const std::string& name, const std::string& point, const PointPair& line);

}  // namespace costate
