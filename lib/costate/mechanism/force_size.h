// How large a mechanism's forces are: what its reactions are compared with where they are small.
#pragma once

#include "costate/mechanism/mechanism.h"

namespace costate {

/// The unit of force of a mechanism's tolerances [N]: 1 for mechanisms with forces of 1 mN and more, of which nothing
/// changes; for lighter ones the power of ten next above the largest force that a number of the scene makes as a weight
/// or over the mechanism's length (a mass, a stiffness, a damping, a force), so that it does not move within a scene.
/// 1, too, where a force's numbers do not tell their unit, or its class is a user's.
double force_size(const Mechanism& mechanism);

}  // namespace costate
