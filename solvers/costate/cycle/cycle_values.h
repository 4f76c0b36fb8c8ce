// Costs that hold the cycle's own period, travel, speed or largest multiplier (objective/cycle_output.h): these numbers
// become parameters behind the problem's own, with the values that the search has found, so that any method
// differentiates psi by them as by any other; what they themselves do as the cycle moves is added by the chain rule.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "costate/objective/cycle_output.h"
#include "costate/problem/problem.h"

namespace costate {

/// By kCyclePeriod, ...
using CycleValues = Eigen::Matrix<double, kCycleValues, 1>;

/// Whether some output of the mechanism is a value of cycles.
bool has_cycle_values(const Problem& problem);
/// For motions that are no cycle's: without the cost where that may hold values of a cycle.
Problem without_cycle_cost(Problem problem);

/// The problem with the cycle's values as parameters behind its own.
struct ValuedProblem {
  Problem problem;
  std::vector<double> rho;
};
ValuedProblem with_cycle_values(const Problem& problem, const std::vector<double>& rho, const CycleValues& values);

/// psi's derivatives by the period and the travel, those through the speed included.
struct PeriodTravel {
  double period = 0, travel = 0;
};
PeriodTravel by_period_and_travel(const CycleValues& by_values, const CycleValues& values);

}  // namespace costate
