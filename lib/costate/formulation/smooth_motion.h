// Whether a motion has as many derivatives as an integrator may ask for: nothing in the equations or the running cost
// that begins, ends, touches, bends, is narrow or jumps. Over bends low orders do better than high ones.
#pragma once

#include "costate/event/touch_watch.h"
#include "costate/formulation/step_plan.h"
#include "costate/formulation/system.h"

namespace costate {

/// Whether forces or running costs may bend along a motion, in places that event/bend_watch.h knows or in others.
bool may_bend(Assembly& assembly, const Objective& objective, double rtol, double atol);

/// Of a run whose steps these watch until t_end; what moves by less than the tolerances is rounding.
bool is_smooth(System& system, const TouchWatch& touches, const StepPlan& plan, double t_end, double rtol, double atol);

}  // namespace costate
