#include "costate/tradeoff/gradient_price.h"

#include "costate/sensitivity/method.h"

namespace costate {

namespace {

/// In simulations, as measured on the five-bar, Andrews' mechanism, the car axis and a top, and over bends on the
/// Iltis' rides, with 1 to 24 parameters at rtol 1e-5 and 1e-8.
struct Prices {
  double tangent, adjoint;                     // of each parameter; of all
  double bent_tangents = 0, bent_adjoint = 0;  // besides, over bends
};
constexpr Prices kIdas = {0.3, 0.9, 0, 0.9}, kCvodes = {0.12, 0.55, 0, 0.95}, kRadau = {0.6, 2, 2, 2},
                 kExplicit = {0.7, 0.5, 2.5, 2.5};

const Prices& prices_of(const Integrator& integrator) {
  const bool residual = integrator.form == Integrator::Form::residual;
  if (integrator.discrete) return residual ? kRadau : kExplicit;
  return residual ? kIdas : kCvodes;
}

/// The gradient method that goes with an integrator, or null.
const SensitivityMethod* method_on(const Integrator& integrator, bool adjoint) {
  using Needs = SensitivityMethod::Needs;
  const Needs needs = integrator.discrete                             ? Needs::discrete
                      : integrator.form == Integrator::Form::residual ? Needs::dae
                                                                      : Needs::ode;
  return first_method(
      [&](const SensitivityMethod& m) { return m.needs == needs && m.adjoint == adjoint && !m.perturbs; });
}

}  // namespace

std::string adjoint_on(const Integrator& integrator) { return method_on(integrator, true)->name; }

GradientPrice least_price(const Formulation& formulation, const Integrator& integrator, std::size_t parameters,
                          bool bends) {
  const Prices& prices = prices_of(integrator);
  const double tangents = prices.tangent * static_cast<double>(parameters) + (bends ? prices.bent_tangents : 0),
               adjoint = prices.adjoint + (bends ? prices.bent_adjoint : 0);
  const bool back = adjoint < tangents;
  for (const bool a : {back, !back})
    if (const SensitivityMethod* m = method_on(integrator, a); m && refusal(*m, formulation).empty())
      return {m->name, a ? adjoint : tangents};
  return {};
}

}  // namespace costate
