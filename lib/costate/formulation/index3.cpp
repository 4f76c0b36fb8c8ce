// Registers the index-3 formulation: R1 = 0 and Phi = 0, as the equations come. IDAS is not given them raw: a solver of
// variable step cannot control the error of index-3 multipliers. It carries them in stabilised index-2 form instead
// (index2_dae.h), whose solution is the same; by fixed steps they are carried as they are (discrete/index3_steps.cpp).
// So are the hand-derived equations where contacts close: what sticks keeps rates alone, Phid = 0, which has no index-3
// form.
#include "costate/adjoint/momentum_adjoint.h"
#include "costate/adjoint/tangent_equations.h"
#include "costate/formulation/formulation.h"
#include "costate/formulation/index2_dae.h"

namespace costate {
namespace {

bool rows_switch(const std::shared_ptr<const Mechanism>& mechanism, const ParameterSelection& parameters) {
  return Assembly(mechanism, parameters).has_switched_rows();
}

Formulation index3() {
  Formulation f;
  f.name = "index3";
  f.summary = "constraints at position level: by fixed steps with projections; on IDAS in stabilised index-2 form";
  f.constraints = ConstraintForm::index3;
  f.default_integrator = "idas";
  f.make_dae = [](auto mechanism, auto parameters, auto objective, const FormulationOptions&) {
    return std::make_unique<Index2Dae>(mechanism, parameters, objective);
  };
  f.make_hand_tangent = [](auto mechanism, auto parameters, auto objective, const FormulationOptions&) {
    using Constraints = TangentEquations::Constraints;
    return std::make_unique<TangentEquations>(
        mechanism, parameters, objective, Stabilization{},
        rows_switch(mechanism, parameters) ? Constraints::index2 : Constraints::index3);
  };
  f.make_hand_adjoint = [](auto mechanism, auto parameters, auto objective, const FormulationOptions&) {
    using Constraints = MomentumAdjoint::Constraints;
    return std::make_unique<MomentumAdjoint>(
        mechanism, parameters, objective,
        rows_switch(mechanism, parameters) ? Constraints::index2 : Constraints::index3);
  };
  f.candidate_stabilization = [](const auto&, const FormulationOptions&) { return Stabilization{}; };
  return f;
}

const RegisterFormulation index3_registered(index3());

}  // namespace
}  // namespace costate
