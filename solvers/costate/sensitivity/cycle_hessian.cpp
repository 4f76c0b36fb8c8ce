#include "costate/sensitivity/cycle_hessian.h"

#include <Eigen/Dense>

#include "costate/base/error.h"
#include "costate/cycle/cycle.h"
#include "costate/cycle/cycle_start.h"
#include "costate/integrator/simulate.h"

namespace costate {

namespace {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
}  // namespace

// With l of (18.6) and c the cycle's own values, psi along the cycle has the second derivatives of
// L = psi(x, rho, c) + l^T (P - x) + psi_c (C(x, rho) - c) along (x_rho, 1, c_rho): what is linear in second
// derivatives of x and c falls out.
HessianProducts cycle_hessian_products(const Problem& problem, const std::vector<double>& rho,
                                       const MatrixXd& directions) {
  CycleOptions options;
  options.estimate = false;
  Problem p = problem;
  if (find_integrator(integrator_of(p)).discrete) p.solver.integrator.clear();  // cycles are found by IDAS or CVODES
  const CycleResult cycle = find_cycle(p, *p.cycle, rho, options);
  HessianProducts r;
  r.psi = cycle.psi.value;
  r.gradient.assign(cycle.psi_rho.data(), cycle.psi_rho.data() + cycle.psi_rho.size());
  r.counters = cycle.counters;
  const Index np = static_cast<Index>(rho.size());
  const CycleValues values = cycle.values(), by = cycle.psi_values;
  const auto no_multiplier = [](double is_there) {
    if (is_there != 0)
      throw CapabilityError(
          "The cost holds the cycle's largest multiplier, whose second derivatives would be third ones of the motion.");
  };
  no_multiplier(by[kCycleMultiplier]);
  const CycleStart start(p, *p.cycle, rho);
  const Section& section = start.section();
  const bool valued = has_cycle_values(p);
  const ValuedProblem with = valued ? with_cycle_values(p, rho, values) : ValuedProblem{p, rho};
  const ReturnMap map(with.problem, section, with.rho, valued ? kCycleValues : 0);
  const auto& free = section.free();
  const auto k = static_cast<Index>(free.size());
  const MatrixXd A = MatrixXd::Identity(k, k) - cycle.map.next_x(free, free);
  const PeriodTravel weights = by_period_and_travel(by, values);
  const Eigen::RowVectorXd psi_x =
      cycle.map.psi_x + weights.period * cycle.map.time_x + weights.travel * cycle.map.travel_x;
  CycleWeights of{VectorXd::Zero(section.size()), weights.period, weights.travel};
  const VectorXd l = A.transpose().partialPivLu().solve(psi_x(free).transpose());
  of.next(free) = l;
  // Along the branch: x, the parameters, the cycle's values.
  const VectorXd speed = cycle.speed_rho();
  MatrixXd branch = MatrixXd::Zero(section.size() + static_cast<Index>(with.rho.size()), np);
  branch.topRows(section.size()) = cycle.x_rho;
  branch.middleRows(section.size(), np).setIdentity();
  const Index own = section.size() + np;
  if (valued) {
    branch.row(own + kCyclePeriod) = cycle.period_rho.transpose();
    branch.row(own + kCycleTravel) = cycle.travel_rho.transpose();
    branch.row(own + kCycleSpeed) = speed.transpose();
  }
  const MatrixXd along = branch * directions,
                 products = map.second_products(cycle.x, cycle.positions, cycle.map, of, along, r.counters);
  if (valued) no_multiplier(products.row(own + kCycleMultiplier).cwiseAbs().maxCoeff());
  r.products = branch.transpose() * products;
  // The speed s/T curves by itself: its second derivative along T and s.
  if (by[kCycleSpeed] != 0) {
    const double T = values[kCyclePeriod];
    r.products -=
        by[kCycleSpeed] / T *
        (speed * (cycle.period_rho.transpose() * directions) + cycle.period_rho * (speed.transpose() * directions));
  }
  return r;
}

}  // namespace costate
