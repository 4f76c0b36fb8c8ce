#include "costate/cycle/cycle_values.h"

#include <cmath>

namespace costate {

bool has_cycle_values(const Problem& problem) { return !cycle_value_numbers(*problem.mechanism).empty(); }

Problem without_cycle_cost(Problem problem) {
  if (has_cycle_values(problem)) problem.objective = {};
  return problem;
}

ValuedProblem with_cycle_values(const Problem& problem, const std::vector<double>& rho, const CycleValues& values) {
  ValuedProblem r{problem, rho};
  const std::vector<int> numbers = cycle_value_numbers(*problem.mechanism);
  for (int i = 0; i < kCycleValues; ++i) {
    Parameter p;
    p.name = cycle_value_names()[static_cast<std::size_t>(i)];
    p.bindings = {{numbers[static_cast<std::size_t>(i)], 1.0}};
    p.value = values[i] + 0.0;  // -0 is an unknown one
    if (values[i] != 0) p.scale = std::abs(values[i]);
    r.problem.parameters.parameters.push_back(p);
    r.rho.push_back(p.value);
  }
  return r;
}

PeriodTravel by_period_and_travel(const CycleValues& by, const CycleValues& values) {
  // v = s/T
  const double T = values[kCyclePeriod], v = values[kCycleSpeed];
  return {by[kCyclePeriod] - by[kCycleSpeed] * v / T, by[kCycleTravel] + by[kCycleSpeed] / T};
}

}  // namespace costate
