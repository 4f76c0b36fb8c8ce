#include "costate/formulation/smooth_motion.h"

#include "costate/event/bend_watch.h"
#include "costate/formulation/law_joins.h"

namespace costate {

bool may_bend(Assembly& assembly, const Objective& objective, double rtol, double atol) {
  return bends_of(assembly.mechanism(), assembly.numbers()) != Bends::none ||
         !BendWatch(assembly, objective, rtol, atol, true).empty();
}

bool is_smooth(System& system, const TouchWatch& touches, const StepPlan& plan, double t_end, double rtol,
               double atol) {
  Assembly& assembly = system.assembly();
  return touches.empty() && !system.may_jump() && plan.even(t_end) &&
         !may_bend(assembly, system.objective(), rtol, atol);
}

}  // namespace costate
