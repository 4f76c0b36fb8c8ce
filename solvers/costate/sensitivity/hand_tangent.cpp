// Method "hand-tangent": the formulation's hand-derived tangent equations, integrated by their own pass.
#include "costate/sensitivity/hand_run.h"
#include "costate/sensitivity/method.h"

namespace costate {
namespace {

GradientResult run_hand_tangent(const Problem& problem, const std::vector<double>& rho) {
  const auto equations =
      find_formulation(problem.formulation)
          .make_hand_tangent(problem.mechanism, problem.parameters, problem.objective, problem.formulation_options);
  return run_hand_equations(problem, rho, *equations);
}

const RegisterSensitivityMethod hand_tangent_registered({
    .name = "hand-tangent",
    .summary = "the formulation's hand-derived tangent equations, on a Radau scheme of ours",
    .needs = SensitivityMethod::Needs::hand_tangent,
    .gradient = run_hand_tangent,
});

}  // namespace
}  // namespace costate
