// Whether a step of Maggi's formulations ends on the branch that it began on (level/branch_watch.h), and in a chart
// that serves: the same for the explicit and the implicit one.
#pragma once

#include "costate/level/maggi_level.h"

namespace costate {

/// Of a step from `from` to the solved point, accelerations known, that is not yet accepted.
bool keeps_branch(MaggiLevel& level, double from);

/// At the end t of an accepted step: whether other independent coordinates are wanted from there on. Throws SolverError
/// where the motion has left its branch since the last one, by more than a long step could be off.
bool wants_other_chart(MaggiLevel& level, double t);

}  // namespace costate
