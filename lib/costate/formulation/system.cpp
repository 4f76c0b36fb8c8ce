#include "costate/formulation/system.h"

#include "costate/base/error.h"

namespace costate {

System::System(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective)
    : assembly_(std::move(mechanism), std::move(parameters)), objective_(std::move(objective)) {
  cost_gradient_.resize(assembly_);
}

void System::set_parameters(const double* rho) { assembly_.set_parameters(rho); }

double System::running_cost(double t, const double* y) {
  const bool accelerations = objective_.running_needs_accelerations();
  return objective_.running_value(accelerations ? physical_state(t, y) : kinematic_state(t, y), assembly_);
}

double System::terminal_cost(double t, const double* y) {
  const bool accelerations = objective_.terminal_needs_accelerations();
  return objective_.terminal_value(accelerations ? physical_state(t, y) : kinematic_state(t, y), assembly_);
}

namespace {
[[noreturn]] void no_jump() { throw Error("This system's trajectories have no jumps."); }
}  // namespace

void DaeSystem::jump(double, double*, double*) { no_jump(); }
void DaeSystem::jump_tangent(const Jump&, double* const*, double* const*, int) { no_jump(); }
void DaeSystem::jump_adjoint(const Jump&, double*, double*, double*) { no_jump(); }
void OdeSystem::jump(double, double*) { no_jump(); }
void OdeSystem::jump_tangent(const Jump&, double* const*, int) { no_jump(); }
void OdeSystem::jump_adjoint(const Jump&, double*, double*) { no_jump(); }

}  // namespace costate
