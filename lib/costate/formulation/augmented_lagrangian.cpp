// Augmented Lagrangian at acceleration level: lambda*_(i+1) = lambda*_i + alpha R2 to R2 = 0. Converged, its equations,
// tangent and adjoint are exactly those of Baumgarte's; redundant rows are allowed.
#include "costate/adjoint/acceleration_adjoint.h"
#include "costate/adjoint/hessian_equations.h"
#include "costate/adjoint/tangent_equations.h"
#include "costate/formulation/acceleration_ode.h"
#include "costate/formulation/formulation.h"
#include "costate/level/penalty_weight.h"

namespace costate {
namespace {

Stabilization iterated(const std::shared_ptr<const Mechanism>& mechanism, const FormulationOptions& o) {
  Stabilization s = penalty_stabilization(mechanism, o);
  s.augmented = true;
  return s;
}

/// The hand-derived equations are those of converged iterations, exact constraints. Their matrices are to be regular
/// with redundant rows, too: a weight 1e4 times larger leaves some 1e-12 of the masses, below what anyone can see.
Stabilization converged(const std::shared_ptr<const Mechanism>& mechanism, const FormulationOptions& o) {
  return {o.penalty_xi, o.penalty_omega_rad_per_s, 1e-4 / default_penalty_weight(mechanism), false};
}

const RegisterFormulation registered({
    "augmented-lagrangian",
    "penalty iterated to exact constraints (ALF index-1); carries redundant constraints",
    true,
    "cvodes",
    {},
    [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
      const Stabilization s = iterated(mechanism, o);
      return std::make_unique<AccelerationOde>(mechanism, parameters, objective, s);
    },
    {},
    [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
      return std::make_unique<TangentEquations>(mechanism, parameters, objective, converged(mechanism, o),
                                                TangentEquations::Constraints::acceleration);
    },
    [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
      return std::make_unique<AccelerationAdjoint>(mechanism, parameters, objective, converged(mechanism, o));
    },
    [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
      return std::make_unique<HessianEquations>(mechanism, parameters, objective, iterated(mechanism, o));
    },
});

}  // namespace
}  // namespace costate
