// Penalty with its second-order adjoint: the motion is that of "penalty"; the hand-derived adjoint integrates mu and
// mu' themselves.
#include "costate/adjoint/second_order_adjoint.h"
#include "costate/adjoint/tangent_equations.h"
#include "costate/formulation/acceleration_ode.h"
#include "costate/formulation/formulation.h"
#include "costate/level/penalty_weight.h"

namespace costate {
namespace {

const RegisterFormulation registered({
    "penalty-second-order",
    "penalty with the second-order adjoint (mu and its rate are integrated)",
    true,
    "cvodes",
    {},
    [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
      const Stabilization s = penalty_stabilization(mechanism, o);
      return std::make_unique<AccelerationOde>(mechanism, parameters, objective, s);
    },
    {},
    [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
      return std::make_unique<TangentEquations>(mechanism, parameters, objective, penalty_stabilization(mechanism, o),
                                                TangentEquations::Constraints::acceleration);
    },
    [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
      return std::make_unique<SecondOrderAdjoint>(mechanism, parameters, objective,
                                                  penalty_stabilization(mechanism, o));
    },
});

}  // namespace
}  // namespace costate
