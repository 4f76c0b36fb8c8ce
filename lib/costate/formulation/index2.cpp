// Registers the stabilised index-2 formulation.
#include "costate/adjoint/momentum_adjoint.h"
#include "costate/adjoint/tangent_equations.h"
#include "costate/formulation/formulation.h"
#include "costate/formulation/index2_dae.h"

namespace costate {
namespace {

const RegisterFormulation index2_registered({
    .name = "index2",
    .summary = "index 3 in stabilised index-2 form (Gear, Gupta, Leimkuhler): no drift in positions and velocities",
    .constraints = ConstraintForm::index2,
    .default_integrator = "idas",
    .make_dae = [](auto mechanism, auto parameters, auto objective,
                   const FormulationOptions&) { return std::make_unique<Index2Dae>(mechanism, parameters, objective); },
    .make_hand_tangent =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions&) {
          return std::make_unique<TangentEquations>(mechanism, parameters, objective, Stabilization{},
                                                    TangentEquations::Constraints::index2);
        },
    .make_hand_adjoint =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions&) {
          return std::make_unique<MomentumAdjoint>(mechanism, parameters, objective,
                                                   MomentumAdjoint::Constraints::index2);
        },
    .candidate_stabilization = [](const auto&, const FormulationOptions&) { return Stabilization{}; },
});

}  // namespace
}  // namespace costate
