// A formulation of one's own, with an option of its own. Index 1 whose constraint errors decay as fast as they can
// without swinging over, R2 = Phidd + 2/T Phid + 1/T^2 Phi = 0: Baumgarte's stabilisation at critical damping, set by
// the time T alone.
#pragma once

#include "costate/level/acceleration_level.h"

namespace tutorial {

/// xi = 1 and omega = 1/T. decay_time_s > 0.
costate::Stabilization critically_damped(double decay_time_s);

}  // namespace tutorial
