#include "costate/problem/problem.h"

#include <fmt/format.h>

#include <cmath>

#include "costate/base/error.h"
#include "costate/discrete/discrete_scheme.h"
#include "costate/formulation/law_joins.h"

namespace costate {

std::vector<std::pair<std::string, long>> counter_list(const Counters& c) {
  return {{"steps", c.steps},
          {"residuals", c.residuals},
          {"jacobians", c.jacobians},
          {"newton_iterations", c.newton_iterations},
          {"error_test_failures", c.error_test_failures},
          {"convergence_failures", c.convergence_failures},
          {"backward_steps", c.backward_steps},
          {"backward_residuals", c.backward_residuals},
          {"backward_jacobians", c.backward_jacobians},
          {"backward_newton_iterations", c.backward_newton_iterations},
          {"backward_error_test_failures", c.backward_error_test_failures},
          {"backward_convergence_failures", c.backward_convergence_failures},
          {"sensitivity_residuals", c.sensitivity_residuals},
          {"factorizations", c.factorizations},
          {"checkpoints", c.checkpoints},
          {"simulations", c.simulations},
          {"jumps", c.jumps},
          {"position_iterations", c.position_iterations}};
}

void Problem::check_values(const std::vector<double>& rho) const {
  const std::size_t expected = parameters.parameters.size();
  if (rho.size() != expected)
    throw Error(
        fmt::format("The run varies {} parameters, but {} values are given; parameters.values() are those of "
                    "the scene.",
                    expected, rho.size()));
  for (std::size_t j = 0; j < expected; ++j)
    if (!std::isfinite(rho[j]))
      throw Error(fmt::format("The value of parameter '{}' is {}; expected a finite number.",
                              parameters.parameters[j].name, rho[j]));
  std::vector<double> numbers = mechanism->base_numbers();
  parameters.apply(rho.data(), numbers);
  require_joined_drivers(*mechanism, numbers, solver.t_start, solver.t_end);
}

std::unique_ptr<DaeSystem> Problem::make_dae() const {
  const Formulation& f = find_formulation(formulation);
  if (!f.make_dae)
    throw CapabilityError(fmt::format("Formulation '{}' has no residual form for IDAS; use CVODES.", formulation));
  return f.make_dae(mechanism, parameters, objective, formulation_options);
}

std::unique_ptr<OdeSystem> Problem::make_ode() const {
  const Formulation& f = find_formulation(formulation);
  if (!f.make_ode)
    throw CapabilityError(
        fmt::format("Formulation '{}' is a DAE without an explicit right-hand side, so CVODES cannot "
                    "integrate it; use IDAS, or a formulation at acceleration level (index1, "
                    "baumgarte, penalty).",
                    formulation));
  return f.make_ode(mechanism, parameters, objective, formulation_options);
}

std::unique_ptr<DiscreteScheme> Problem::make_discrete() const {
  const Formulation& f = find_formulation(formulation);
  if (!f.make_discrete)
    throw CapabilityError(
        fmt::format("Formulation '{}' has no fixed-step scheme; formulation 'index3' has one.", formulation));
  return f.make_discrete(mechanism, parameters, objective, formulation_options);
}

}  // namespace costate
