// [spherical.NAME]: a ball joint that keeps two points of space together.
#pragma once

#include <string>
#include <utility>

#include "costate/mechanism/builder.h"

namespace costate {

void add_spherical(MechanismBuilder& builder, const std::string& name,
                   const std::pair<std::string, std::string>& points);

}  // namespace costate
