// Method "cvodes-adjoint": adjoint of CVODES: one backward run whatever the number of parameters.
#include "costate/sensitivity/integrator_gradient.h"
#include "costate/sensitivity/method.h"

namespace costate {
namespace {

GradientResult run_cvodes_adjoint(const Problem& problem, const std::vector<double>& rho) {
  return with_bdf_where_stiff(
      problem, [&](const Problem& p) { return adjoint_gradient<CvodeRun>(*p.make_ode(), p, rho, "cvodes"); });
}

const RegisterSensitivityMethod cvodes_adjoint_registered({
    .name = "cvodes-adjoint",
    .summary = "adjoint of CVODES: one backward run whatever the number of parameters",
    .needs = SensitivityMethod::Needs::ode,
    .gradient = run_cvodes_adjoint,
    .adjoint = true,
    .keeps_checkpoints = true,
});

}  // namespace
}  // namespace costate
