// [distance.NAME]: keeps the distance between two points: a massless rod between points of any sort.
#pragma once

#include <optional>
#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

/// Default length: the distance of the points at the start.
void add_distance(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
                  std::optional<double> length_m);

}  // namespace costate
