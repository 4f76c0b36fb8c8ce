#include "costate/sensitivity/cycle_hessian.h"

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/sensitivity/cycle_lagrangian.h"

namespace costate {

using Eigen::Index;
using Eigen::MatrixXd;

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
  const CycleValues by = cycle.psi_values;
  const auto no_multiplier = [](double is_there) {
    if (is_there != 0)
      throw CapabilityError(
          "The cost holds the cycle's largest multiplier, whose second derivatives would be third ones of the motion.");
  };
  no_multiplier(by[kCycleMultiplier]);
  const CycleLagrangian lagrangian(p, rho, cycle);
  const ReturnMap& map = lagrangian.map();
  const bool valued = lagrangian.valued();
  const Index size = lagrangian.section().size(), own = size + np;
  // Along the branch: x, the parameters, the cycle's values.
  const Eigen::VectorXd speed = cycle.speed_rho();
  MatrixXd branch = MatrixXd::Zero(size + static_cast<Index>(map.rho().size()), np);
  branch.topRows(size) = cycle.x_rho;
  branch.middleRows(size, np).setIdentity();
  if (valued) {
    branch.row(own + kCyclePeriod) = cycle.period_rho.transpose();
    branch.row(own + kCycleTravel) = cycle.travel_rho.transpose();
    branch.row(own + kCycleSpeed) = speed.transpose();
  }
  const MatrixXd along = branch * directions, products = map.second_products(cycle.x, cycle.positions, cycle.map,
                                                                             lagrangian.weights(), along, r.counters);
  if (valued) no_multiplier(products.row(own + kCycleMultiplier).cwiseAbs().maxCoeff());
  r.products = branch.transpose() * products;
  // The speed s/T curves by itself: its second derivative along T and s.
  if (by[kCycleSpeed] != 0) {
    const double T = cycle.period.value;
    r.products -=
        by[kCycleSpeed] / T *
        (speed * (cycle.period_rho.transpose() * directions) + cycle.period_rho * (speed.transpose() * directions));
  }
  return r;
}

}  // namespace costate
