// The motion that second derivatives are taken along, stored with its tangents, and where something happens on its way
// that they have to be carried across: bends of forces, which are found along the stored motion and have steps end at
// them, and events.
#pragma once

#include <memory>
#include <vector>

#include "costate/formulation/hessian_systems.h"
#include "costate/formulation/step_plan.h"
#include "costate/hessian/slip_maps.h"
#include "costate/integrator/trajectory.h"
#include "costate/problem/problem.h"

namespace costate {

struct HessianMotion {
  Trajectory trajectory;
  std::vector<HessianEquations::Bend> bends;    // in order
  std::vector<HessianEquations::Event> events;  // in order
  std::vector<SlipMap> slips;                   // in order
  std::shared_ptr<const StepPlan> plan_back;    // for the run back
  long steps = 0;
  Counters counters;
};

/// Of an event of n coordinates: that of a contact that gives. Its force's derivatives may begin with the root of the
/// time since then, and its second derivatives with the root's inverse.
bool begins_steeply(const HessianEquations::Event& event, int n);

/// At these parameters. Throws CapabilityError where psi has no second derivative, or none that is known here.
HessianMotion run_hessian_motion(const Problem& problem, const std::vector<double>& rho, HessianEquations& equations,
                                 TangentMotion& forward);

}  // namespace costate
