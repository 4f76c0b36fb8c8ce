// Method "idas-adjoint": adjoint of IDAS: one backward run whatever the number of parameters.
#include "costate/sensitivity/integrator_gradient.h"
#include "costate/sensitivity/method.h"

namespace costate {
namespace {

GradientResult run(const Problem& problem, const std::vector<double>& rho) {
  return adjoint_gradient<IdaRun>(*problem.make_dae(), problem, rho, "idas");
}

const RegisterSensitivityMethod registered({
    "idas-adjoint",
    "adjoint of IDAS: one backward run whatever the number of parameters",
    SensitivityMethod::Needs::dae,
    run,
});

}  // namespace
}  // namespace costate
