// The gradient of a cost in Maggi's formulations, as the level pulls it back to independent coordinates.
#pragma once

#include "costate/level/maggi_level.h"
#include "costate/objective/objective.h"

namespace costate {

/// g gains the gradient of the running or the terminal cost at the linearized point of the level. Where contacts hold a
/// body more often than determines who bears what, accelerations and multipliers are those that are shared out, and are
/// eliminated.
void add_maggi_cost_gradient(MaggiLevel& level, const Objective& objective, bool terminal, ScalarGradient& g);

}  // namespace costate
