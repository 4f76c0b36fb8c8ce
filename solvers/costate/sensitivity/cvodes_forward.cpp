// Method "cvodes-forward": forward sensitivities of CVODES: one linear system a parameter and step.
#include "costate/sensitivity/integrator_gradient.h"
#include "costate/sensitivity/method.h"

namespace costate {
namespace {

GradientResult run(const Problem& problem, const std::vector<double>& rho) {
  return forward_gradient<CvodeRun>(*problem.make_ode(), problem, rho, "cvodes", CvodeSession::Cost::state);
}

const RegisterSensitivityMethod registered({
    "cvodes-forward",
    "forward sensitivities of CVODES: one linear system a parameter and step",
    SensitivityMethod::Needs::ode,
    run,
});

}  // namespace
}  // namespace costate
