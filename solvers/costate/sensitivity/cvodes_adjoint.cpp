// Method "cvodes-adjoint": adjoint of CVODES: one backward run whatever the number of parameters.
#include "costate/sensitivity/integrator_gradient.h"
#include "costate/sensitivity/method.h"

namespace costate {
namespace {

GradientResult run(const Problem& problem, const std::vector<double>& rho) {
  return adjoint_gradient<CvodeRun>(*problem.make_ode(), problem, rho, "cvodes");
}

const RegisterSensitivityMethod registered({
    "cvodes-adjoint",
    "adjoint of CVODES: one backward run whatever the number of parameters",
    SensitivityMethod::Needs::ode,
    run,
});

}  // namespace
}  // namespace costate
