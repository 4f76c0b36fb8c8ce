// How long a mechanism is: what its lengths are compared with where they are zero, or nearly.
#pragma once

#include <vector>

#include "costate/mechanism/mechanism.h"

namespace costate {

/// The unit of length of a mechanism's tolerances [m]: 1 for mechanisms of 0.1 m and more, of which nothing changes;
/// for smaller ones the power of ten next above their largest length. Steps of ten, so that it hardly ever moves with a
/// parameter, and the scene's own numbers, so that it does not at all within a scene.
double length_size(const Mechanism& mechanism);

/// What coordinates count with beside lengths: 1 each length, the mechanism's length an angle or an Euler parameter.
std::vector<double> coordinate_levers(const Mechanism& mechanism, double length);

}  // namespace costate
