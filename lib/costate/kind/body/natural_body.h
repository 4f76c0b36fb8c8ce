// [natural_body.NAME]: a rigid body in space in natural coordinates, with the keys of [rigid_body.NAME].
// Coordinates NAME.x, .y, .z of its reference point and NAME.u1x ... NAME.u3z, the components of its base
// vectors. In [start], NAME gives its whole pose and motion, NAME.orientation its turn and angular velocity,
// and NAME.omega_x (body's frame), NAME.omega_global_x, ... are velocities that can be given.
#pragma once

#include <string>

#include "costate/kind/body/rigid_body.h"

namespace costate {

void add_natural_body(MechanismBuilder& builder, const std::string& name, const RigidBodyOptions& options);

}  // namespace costate
