// [coordinate.NAME]: a generalized coordinate of its own, without inertia, that other things refer to by its name: a
// steering rack's displacement, a control input. A driver, or what it is tied to, determines it.
#pragma once

#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

/// `unit` is that of the coordinate ("m", "rad"); `value` and `rate` are its start, or first guess.
void add_own_coordinate(MechanismBuilder& builder, const std::string& name, const std::string& unit, double value,
                        double rate);

}  // namespace costate
