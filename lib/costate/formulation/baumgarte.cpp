// Baumgarte: R2 = Phidd + 2 xi omega Phidot + omega^2 Phi = 0 (lib/README.md (3)).
#include "costate/adjoint/acceleration_adjoint.h"
#include "costate/adjoint/hessian_equations.h"
#include "costate/adjoint/tangent_equations.h"
#include "costate/formulation/acceleration_dae.h"
#include "costate/formulation/acceleration_ode.h"
#include "costate/formulation/defaults.h"
#include "costate/formulation/formulation.h"

namespace costate {
namespace {

const FormulationOption xi{.key = "baumgarte_xi",
                           .help = "damping ratio of the constraints' error in baumgarte",
                           .number = 1,
                           .rule = NumberRule::non_negative};
const FormulationOption omega{.key = "baumgarte_omega_rad_per_s",
                              .help = "frequency of the constraints' error in baumgarte",
                              .number = 10,
                              .rule = NumberRule::positive};

Stabilization stabilization(const FormulationOptions& o) { return {xi.number_in(o), omega.number_in(o), 0}; }

const RegisterFormulation baumgarte_registered({
    .name = kDefaultFormulation,
    .summary = "constraints at acceleration level with Baumgarte's stabilisation",
    .stand_in = 1,
    .default_integrator = "idas",
    .options = {xi, omega},
    .make_dae =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<AccelerationDae>(mechanism, parameters, objective, stabilization(o));
        },
    .make_ode =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<AccelerationOde>(mechanism, parameters, objective, stabilization(o));
        },
    .make_hand_tangent =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<TangentEquations>(mechanism, parameters, objective, stabilization(o),
                                                    TangentEquations::Constraints::acceleration);
        },
    .make_hand_adjoint =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<AccelerationAdjoint>(mechanism, parameters, objective, stabilization(o));
        },
    .make_hessian =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<HessianEquations>(mechanism, parameters, objective, stabilization(o));
        },
    .candidate_stabilization = [](const auto&, const FormulationOptions& o) { return stabilization(o); },
});

}  // namespace
}  // namespace costate
