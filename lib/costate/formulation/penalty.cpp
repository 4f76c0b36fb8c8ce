// Penalty (Bayo): (M + Phi_q^T alpha Phi_q) a = Q - Phi_q^T alpha (...), kept in saddle form with
// lambda* = alpha (Phidd + 2 xi omega Phidot + omega^2 Phi) as an unknown, lib/README.md (4). The gradient differs
// from that of exact constraints by O(1/alpha); in saddle form a large alpha costs no digits.
#include "costate/adjoint/acceleration_adjoint.h"
#include "costate/adjoint/hessian_equations.h"
#include "costate/adjoint/tangent_equations.h"
#include "costate/formulation/acceleration_dae.h"
#include "costate/formulation/acceleration_ode.h"
#include "costate/formulation/formulation.h"
#include "costate/level/penalty_weight.h"

namespace costate {
namespace {

const RegisterFormulation penalty_registered({
    .name = "penalty",
    .summary = "constraints as stiff penalties with stabilisation; carries redundant constraints",
    .carries_redundancy = true,
    .weighted = true,
    .stand_in = 4,
    .default_integrator = "cvodes",
    .options = penalty_options(),
    .make_dae =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          const Stabilization s = penalty_stabilization(mechanism, o);
          return std::make_unique<AccelerationDae>(mechanism, parameters, objective, s);
        },
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
          return std::make_unique<AccelerationAdjoint>(mechanism, parameters, objective,
                                                       penalty_stabilization(mechanism, o));
        },
    .make_hessian =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<HessianEquations>(mechanism, parameters, objective,
                                                    penalty_stabilization(mechanism, o));
        },
    .candidate_stabilization = penalty_stabilization,
    .firmer = firmer_penalty,
    .softness_chosen = penalty_weight_chosen,
});

}  // namespace
}  // namespace costate
