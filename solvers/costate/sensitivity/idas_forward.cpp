// Method "idas-forward": forward sensitivities of IDAS: one linear system a parameter and step.
#include "costate/sensitivity/integrator_gradient.h"
#include "costate/sensitivity/method.h"

namespace costate {
namespace {

GradientResult run_idas_forward(const Problem& problem, const std::vector<double>& rho) {
  return forward_gradient<IdaRun>(*problem.make_dae(), problem, rho, "idas");
}

const RegisterSensitivityMethod idas_forward_registered({
    .name = "idas-forward",
    .summary = "forward sensitivities of IDAS: one linear system a parameter and step",
    .needs = SensitivityMethod::Needs::dae,
    .gradient = run_idas_forward,
});

}  // namespace
}  // namespace costate
