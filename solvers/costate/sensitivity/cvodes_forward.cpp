// Method "cvodes-forward": forward sensitivities of CVODES: one linear system a parameter and step.
#include "costate/sensitivity/integrator_gradient.h"
#include "costate/sensitivity/method.h"

namespace costate {
namespace {

GradientResult run_cvodes_forward(const Problem& problem, const std::vector<double>& rho) {
  return with_bdf_where_stiff(problem, [&](const Problem& p) {
    return forward_gradient<CvodeRun>(*p.make_ode(), p, rho, "cvodes", CvodeSession::Cost::state);
  });
}

const RegisterSensitivityMethod cvodes_forward_registered({
    .name = "cvodes-forward",
    .summary = "forward sensitivities of CVODES: one linear system a parameter and step",
    .needs = SensitivityMethod::Needs::ode,
    .gradient = run_cvodes_forward,
    .is_reference = true,
});

}  // namespace
}  // namespace costate
