// Method "hand-adjoint": the formulation's hand-derived adjoint equations, integrated by their own pass.
#include "costate/sensitivity/hand_run.h"
#include "costate/sensitivity/method.h"

namespace costate {
namespace {

GradientResult run_hand_adjoint(const Problem& problem, const std::vector<double>& rho) {
  const auto equations =
      find_formulation(problem.formulation)
          .make_hand_adjoint(problem.mechanism, problem.parameters, problem.objective, problem.formulation_options);
  return run_hand_equations(problem, rho, *equations);
}

const RegisterSensitivityMethod hand_adjoint_registered({
    .name = "hand-adjoint",
    .summary = "the formulation's hand-derived adjoint equations, on a Radau scheme of ours",
    .needs = SensitivityMethod::Needs::hand_adjoint,
    .gradient = run_hand_adjoint,
    .adjoint = true,
});

}  // namespace
}  // namespace costate
