// Maggi's equations with the matrix R, lib/README.md (5): motion in independent coordinates, with constraints that
// hold to rounding and a change of coordinates where they come near a singular choice.
#include "costate/adjoint/maggi_second_order_adjoint.h"
#include "costate/adjoint/maggi_tangent.h"
#include "costate/formulation/formulation.h"
#include "costate/formulation/maggi_dae.h"
#include "costate/formulation/maggi_ode.h"

namespace costate {
namespace {

template <class SystemType, class Base>
std::unique_ptr<Base> make(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                           Objective objective, const FormulationOptions&) {
  return std::make_unique<SystemType>(std::move(mechanism), std::move(parameters), std::move(objective));
}

template <MaggiTangent::Form form>
std::unique_ptr<HandEquations> make_tangent(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                            Objective objective, const FormulationOptions&) {
  return std::make_unique<MaggiTangent>(std::move(mechanism), std::move(parameters), std::move(objective), form);
}

Stabilization none(const std::shared_ptr<const Mechanism>&, const FormulationOptions&) { return {}; }

const RegisterFormulation explicit_form({
    .name = "maggi",
    .summary = "independent coordinates (matrix R), chosen anew near singularities; explicit first-order form",
    .constraints = ConstraintForm::independent,
    .carries_redundancy = true,
    .default_integrator = "cvodes",
    .make_ode = make<MaggiOde, OdeSystem>,
    .make_hand_tangent = make_tangent<MaggiTangent::Form::explicit_form>,
    .make_hand_adjoint = make<MaggiExplicitAdjoint, HandEquations>,
    .candidate_stabilization = none,
});

const RegisterFormulation implicit_form({
    .name = "maggi-implicit",
    .summary = "the same in implicit first-order form, with accelerations as unknowns",
    .constraints = ConstraintForm::independent,
    .carries_redundancy = true,
    .default_integrator = "idas",
    .make_dae = make<MaggiDae, DaeSystem>,
    .make_hand_tangent = make_tangent<MaggiTangent::Form::implicit_form>,
    .make_hand_adjoint = make<MaggiImplicitAdjoint, HandEquations>,
    .candidate_stabilization = none,
});

// Forward the same equations as "maggi"; what sets it apart is its hand-derived adjoint of second order.
const RegisterFormulation second_order({
    .name = "maggi-second-order",
    .summary = "the equations of 'maggi', for the adjoint of second order",
    .constraints = ConstraintForm::independent,
    .carries_redundancy = true,
    .adjoint_order = 2,
    .default_integrator = "cvodes",
    .make_ode = make<MaggiOde, OdeSystem>,
    .make_hand_tangent = make_tangent<MaggiTangent::Form::explicit_form>,
    .make_hand_adjoint = make<MaggiSecondOrderAdjoint, HandEquations>,
    .candidate_stabilization = none,
});

}  // namespace
}  // namespace costate
