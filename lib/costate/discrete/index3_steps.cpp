// Registers the fixed steps of the index-3 formulation: Newmark's scheme and the generalized-alpha scheme.
#include "costate/discrete/discrete_scheme.h"
#include "costate/formulation/formulation.h"

namespace costate {
namespace {

const FormulationOption scheme{
    .key = "discrete_scheme", .help = "fixed steps: newmark is the trapezoidal rule", .words = discrete_scheme_names()};
const FormulationOption rho_infinity{.key = "discrete_rho_infinity",
                                     .help = "generalized-alpha: what a step leaves of the fastest oscillations",
                                     .number = 0.8,
                                     .rule = NumberRule::non_negative,
                                     .upper = 1};

const RegisterDiscreteForm index3_steps_registered("index3", {scheme, rho_infinity},
                                                   [](auto mechanism, auto parameters, auto objective,
                                                      const FormulationOptions& options) {
                                                     return std::make_unique<DiscreteScheme>(
                                                         mechanism, parameters, objective,
                                                         AlphaCoefficients::make(scheme.word_in(options),
                                                                                 rho_infinity.number_in(options)));
                                                   });

}  // namespace
}  // namespace costate
