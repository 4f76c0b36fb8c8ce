// The scene of the plane that moves as one in space does whose motion stays in a plane across an axis of space.
#pragma once

#include <string>

#include "costate/command.h"
#include "explain_motion.h"

namespace costate::app {

/// As TOML, for bodies, points, masses, springs, gravity, ball joints, hinges about the normal, and planes that hold
/// nothing more or, in pairs, a point. Of the plane's axes x and y are those of space that follow the normal in turn:
/// across z they are x and y, across x they are y and z, across y they are z and x; names of outputs follow. Throws
/// CapabilityError that names what cannot be written so.
std::string plane_scene(const Setup& setup, const PlaneMotion& plane);

}  // namespace costate::app
