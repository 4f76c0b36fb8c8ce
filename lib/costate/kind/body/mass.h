// [mass.NAME]: a mass concentrated at a free point, or at a point of a body in space.
#pragma once

#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

void add_mass(MechanismBuilder& builder, const std::string& name, const std::string& point, double mass_kg);

}  // namespace costate
