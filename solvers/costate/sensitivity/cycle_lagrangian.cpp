#include "costate/sensitivity/cycle_lagrangian.h"

#include <Eigen/Dense>

namespace costate {

CycleLagrangian::CycleLagrangian(const Problem& problem, const std::vector<double>& rho, const CycleResult& cycle)
    : start_(problem, *problem.cycle, rho),
      valued_(has_cycle_values(problem)),
      with_(valued_ ? with_cycle_values(problem, rho, cycle.values()) : ValuedProblem{problem, rho}),
      map_(with_.problem, start_.section(), with_.rho, valued_ ? kCycleValues : 0) {
  const auto& free = section().free();
  const auto k = static_cast<Eigen::Index>(free.size());
  const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(k, k) - cycle.map.next_x(free, free);
  const PeriodTravel by = by_period_and_travel(cycle.psi_values, cycle.values());
  const Eigen::RowVectorXd psi_x = cycle.map.psi_x + by.period * cycle.map.time_x + by.travel * cycle.map.travel_x;
  weights_ = {Eigen::VectorXd::Zero(section().size()), by.period, by.travel};
  const Eigen::VectorXd l = A.transpose().partialPivLu().solve(psi_x(free).transpose());
  weights_.next(free) = l;
}

}  // namespace costate
