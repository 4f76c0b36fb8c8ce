// Penalty with its second-order adjoint: the motion is that of "penalty"; the hand-derived adjoint integrates mu and
// mu' themselves.
#include "costate/adjoint/second_order_adjoint.h"
#include "costate/adjoint/tangent_equations.h"
#include "costate/formulation/acceleration_ode.h"
#include "costate/formulation/formulation.h"
#include "costate/level/penalty_weight.h"

namespace costate {
namespace {

const RegisterFormulation penalty_second_order_registered({
    .name = "penalty-second-order",
    .summary = "penalty with the second-order adjoint (mu and its rate are integrated)",
    .carries_redundancy = true,
    .weighted = true,
    .adjoint_order = 2,
    .default_integrator = "cvodes",
    .options = penalty_options(),
    .make_ode =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          const Stabilization s = penalty_stabilization(mechanism, o);
          return std::make_unique<AccelerationOde>(mechanism, parameters, objective, s);
        },
    .make_hand_tangent =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<TangentEquations>(mechanism, parameters, objective,
                                                    penalty_stabilization(mechanism, o),
                                                    TangentEquations::Constraints::acceleration);
        },
    .make_hand_adjoint =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<SecondOrderAdjoint>(mechanism, parameters, objective,
                                                      penalty_stabilization(mechanism, o));
        },
    .candidate_stabilization = penalty_stabilization,
    .firmer = firmer_penalty,
    .softness_chosen = penalty_weight_chosen,
});

}  // namespace
}  // namespace costate
