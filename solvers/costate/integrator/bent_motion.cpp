#include "costate/integrator/bent_motion.h"

#include "costate/formulation/law_joins.h"
#include "costate/formulation/smooth_motion.h"
#include "costate/integrator/integrators.h"

namespace costate {

bool may_bend(const Problem& problem) {
  Assembly assembly(problem.mechanism, problem.parameters);
  assembly.set_parameters(problem.parameters.values().data());
  return may_bend(assembly, problem.objective, problem.solver.rtol, problem.solver.absolute());
}

bool falls_by_fits(const Problem& problem, const Simulation& run) {
  if (!run.events.empty()) return true;
  // A result of another run's journal tells no integrator.
  if (find_integrator(run.integrator.empty() ? integrator_of(problem) : run.integrator).discrete)
    return bends_of(*problem.mechanism, problem.mechanism->base_numbers()) != Bends::none;
  return may_bend(problem);
}

}  // namespace costate
