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

Stabilization exact(const FormulationOptions& o) {
  return {o.number("penalty_xi"), o.number("penalty_omega_rad_per_s"), 0};
}

/// The hand-derived equations are those of converged iterations, exact constraints. Their matrices are to be regular
/// with redundant rows, too: a weight 1e4 times larger leaves some 1e-12 of the masses, below what anyone can see.
Stabilization converged(const std::shared_ptr<const Mechanism>& mechanism, const FormulationOptions& o) {
  Stabilization s = exact(o);
  s.inverse_alpha = 1e-4 / default_penalty_weight(mechanism);
  return s;
}

const RegisterFormulation augmented_lagrangian_registered({
    .name = "augmented-lagrangian",
    .summary = "penalty iterated to exact constraints (ALF index-1); carries redundant constraints",
    .carries_redundancy = true,
    .weighted = true,
    .stand_in = 3,
    .default_integrator = "cvodes",
    .options = penalty_options(),
    .make_ode =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          const Stabilization s = iterated(mechanism, o);
          return std::make_unique<AccelerationOde>(mechanism, parameters, objective, s);
        },
    .make_hand_tangent =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          auto equations = std::make_unique<TangentEquations>(mechanism, parameters, objective, converged(mechanism, o),
                                                              TangentEquations::Constraints::acceleration);
          equations->lead_back();
          return equations;
        },
    .make_hand_adjoint =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          auto equations =
              std::make_unique<AccelerationAdjoint>(mechanism, parameters, objective, converged(mechanism, o));
          equations->lead_back();
          return equations;
        },
    .make_hessian =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<HessianEquations>(mechanism, parameters, objective, iterated(mechanism, o));
        },
    .candidate_stabilization = [](const auto&, const FormulationOptions& o) { return exact(o); },
});

}  // namespace
}  // namespace costate
