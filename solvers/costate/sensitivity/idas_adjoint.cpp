// Method "idas-adjoint": adjoint of IDAS: one backward run whatever the number of parameters.
#include "costate/formulation/defaults.h"
#include "costate/sensitivity/integrator_gradient.h"
#include "costate/sensitivity/method.h"

namespace costate {
namespace {

GradientResult run_idas_adjoint(const Problem& problem, const std::vector<double>& rho) {
  return adjoint_gradient<IdaRun>(*problem.make_dae(), problem, rho, "idas");
}

const RegisterSensitivityMethod idas_adjoint_registered({
    .name = kDefaultMethod,
    .summary = "adjoint of IDAS: one backward run whatever the number of parameters",
    .needs = SensitivityMethod::Needs::dae,
    .gradient = run_idas_adjoint,
    .adjoint = true,
    .keeps_checkpoints = true,
});

}  // namespace
}  // namespace costate
