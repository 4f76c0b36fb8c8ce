// [revolute.NAME]: a pin that keeps two points together.
#pragma once

#include <string>
#include <utility>

#include "costate/mechanism/builder.h"

namespace costate {

void add_revolute(MechanismBuilder& builder, const std::string& name,
                  const std::pair<std::string, std::string>& points);

}  // namespace costate
