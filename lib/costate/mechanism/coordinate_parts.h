// The parts of a mechanism that have nothing to do with each other: coordinates between which no body, constraint or
// force makes a link.
#pragma once

#include <vector>

#include "costate/mechanism/mechanism.h"

namespace costate {

/// One number a coordinate, that of one of them, the same for those of one part.
std::vector<int> coordinate_parts(const Mechanism& mechanism);
/// The same of what bodies and constraints link, without forces.
std::vector<int> constrained_parts(const Mechanism& mechanism);
/// The same of what bodies alone link.
std::vector<int> body_parts(const Mechanism& mechanism);

}  // namespace costate
