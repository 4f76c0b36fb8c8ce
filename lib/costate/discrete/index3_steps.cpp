// Registers the fixed steps of the index-3 formulation: Newmark's scheme and the generalized-alpha scheme.
#include "costate/discrete/discrete_scheme.h"
#include "costate/formulation/formulation.h"

namespace costate {
namespace {

const RegisterDiscreteForm registered("index3", [](auto mechanism, auto parameters, auto objective,
                                                   const FormulationOptions& options) {
  return std::make_unique<DiscreteScheme>(
      mechanism, parameters, objective,
      AlphaCoefficients::make(options.discrete_scheme, options.discrete_rho_infinity));
});

}  // namespace
}  // namespace costate
