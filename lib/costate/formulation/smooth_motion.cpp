#include "costate/formulation/smooth_motion.h"

#include "costate/event/bend_watch.h"
#include "costate/formulation/law_joins.h"

namespace costate {

bool is_smooth(System& system, const TouchWatch& touches, const StepPlan& plan, double t_end, double rtol,
               double atol) {
  Assembly& assembly = system.assembly();
  return touches.empty() && !system.may_jump() && plan.even(t_end) &&
         bends_of(assembly.mechanism(), assembly.numbers()) == Bends::none &&
         BendWatch(assembly, system.objective(), rtol, atol).empty();
}

}  // namespace costate
