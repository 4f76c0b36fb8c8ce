// Baumgarte: R2 = Phidd + 2 xi omega Phidot + omega^2 Phi = 0 (lib/README.md (3)).
#include "costate/adjoint/acceleration_adjoint.h"
#include "costate/adjoint/hessian_equations.h"
#include "costate/adjoint/tangent_equations.h"
#include "costate/formulation/acceleration_dae.h"
#include "costate/formulation/acceleration_ode.h"
#include "costate/formulation/formulation.h"

namespace costate {
namespace {

Stabilization stabilization(const FormulationOptions& o) { return {o.baumgarte_xi, o.baumgarte_omega_rad_per_s, 0}; }

const RegisterFormulation registered({
    "baumgarte",
    "constraints at acceleration level with Baumgarte's stabilisation",
    false,
    "idas",
    [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
      return std::make_unique<AccelerationDae>(mechanism, parameters, objective, stabilization(o));
    },
    [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
      return std::make_unique<AccelerationOde>(mechanism, parameters, objective, stabilization(o));
    },
    {},
    [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
      return std::make_unique<TangentEquations>(mechanism, parameters, objective, stabilization(o),
                                                TangentEquations::Constraints::acceleration);
    },
    [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
      return std::make_unique<AccelerationAdjoint>(mechanism, parameters, objective, stabilization(o));
    },
    [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
      return std::make_unique<HessianEquations>(mechanism, parameters, objective, stabilization(o));
    },
});

}  // namespace
}  // namespace costate
