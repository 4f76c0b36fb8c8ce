// Index-1: constraints at acceleration level, R2 = Phidd = 0 (lib/README.md (3) with xi = omega = 0).
#include "costate/adjoint/acceleration_adjoint.h"
#include "costate/adjoint/hessian_equations.h"
#include "costate/adjoint/tangent_equations.h"
#include "costate/formulation/acceleration_dae.h"
#include "costate/formulation/acceleration_ode.h"
#include "costate/formulation/formulation.h"

namespace costate {
namespace {

const RegisterFormulation index1_registered({
    .name = "index1",
    .summary = "constraints at acceleration level, no stabilisation (drift grows slowly)",
    .stand_in = 2,
    .default_integrator = "idas",
    .make_dae =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions&) {
          return std::make_unique<AccelerationDae>(mechanism, parameters, objective, Stabilization{});
        },
    .make_ode =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions&) {
          return std::make_unique<AccelerationOde>(mechanism, parameters, objective, Stabilization{});
        },
    .make_hand_tangent =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions&) {
          return std::make_unique<TangentEquations>(mechanism, parameters, objective, Stabilization{},
                                                    TangentEquations::Constraints::acceleration);
        },
    .make_hand_adjoint =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions&) {
          return std::make_unique<AccelerationAdjoint>(mechanism, parameters, objective, Stabilization{});
        },
    .make_hessian =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions&) {
          return std::make_unique<HessianEquations>(mechanism, parameters, objective, Stabilization{});
        },
    .candidate_stabilization = [](const auto&, const FormulationOptions&) { return Stabilization{}; },
});

}  // namespace
}  // namespace costate
