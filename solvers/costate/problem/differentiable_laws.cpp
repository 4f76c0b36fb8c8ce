#include "costate/problem/differentiable_laws.h"

#include "costate/formulation/law_joins.h"
#include "costate/level/fixed_times.h"

namespace costate {

void require_differentiable_laws(const Problem& problem, const std::vector<double>& rho, bool carried) {
  std::vector<double> numbers = problem.mechanism->base_numbers();
  problem.parameters.apply(rho.data(), numbers);
  const double t_start = problem.solver.t_start, t_end = problem.solver.t_end;
  require_fixed_times(*problem.mechanism, problem.objective, problem.parameters, numbers, t_start, t_end, carried);
  require_joined_laws(*problem.mechanism, problem.parameters, numbers, t_start, t_end);
}

void require_twice_differentiable_laws(const Problem& problem, const std::vector<double>& rho) {
  require_differentiable_laws(problem, rho, true);
  std::vector<double> numbers = problem.mechanism->base_numbers();
  problem.parameters.apply(rho.data(), numbers);
  require_even_times(*problem.mechanism, problem.objective, problem.parameters, numbers, problem.solver.t_start,
                     problem.solver.t_end);
}

}  // namespace costate
