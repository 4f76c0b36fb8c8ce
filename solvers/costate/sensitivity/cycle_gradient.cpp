#include "costate/sensitivity/cycle_gradient.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>

#include "costate/base/error.h"
#include "costate/cycle/cycle.h"
#include "costate/cycle/cycle_start.h"
#include "costate/sensitivity/method.h"

namespace costate {

namespace {

using Needs = SensitivityMethod::Needs;

Problem on_integrator_of(const Problem& problem, const SensitivityMethod& method) {
  if (method.needs == Needs::discrete)
    throw CapabilityError("Cycles are not found by discrete methods. Take a method on idas or cvodes.");
  Problem p = problem;
  p.solver.integrator = integrator_of(problem, method);
  return p;
}

void describe(const CycleResult& cycle, const Problem& problem, Simulation& r) {
  r.psi = cycle.psi.value;
  r.counters = cycle.counters;
  r.integrator = cycle.integrator;
  r.events = cycle.events;
  r.end = RunEvent{problem.solver.t_start + cycle.period.value, "the end of a cycle"};
}

}  // namespace

Simulation cycle_run(const Problem& problem, const std::vector<double>& rho) {
  CycleOptions options;
  options.estimate = options.derivatives = false;
  Simulation r;
  describe(find_cycle(problem, *problem.cycle, rho, options), problem, r);
  return r;
}

GradientResult cycle_gradient(const Problem& problem, const std::string& name, const std::vector<double>& rho) {
  const SensitivityMethod& method = find_sensitivity_method(name);
  const Problem p = on_integrator_of(problem, method);
  CycleOptions options;
  options.estimate = false;
  // Where a cycle is several runs, the adjoint would be as many.
  options.derivatives = !method.adjoint || problem.cycle->count > 1;
  const CycleResult cycle = find_cycle(p, *p.cycle, rho, options);
  GradientResult r;
  describe(cycle, p, r);
  if (rho.empty()) return r;
  if (options.derivatives) {
    r.gradient.assign(cycle.psi_rho.data(), cycle.psi_rho.data() + cycle.psi_rho.size());
    return r;
  }
  const CycleStart start(p, *p.cycle, rho);
  const Section& section = start.section();
  const ReturnMap map(p, section, rho);
  const auto& free = section.free();
  const auto k = static_cast<Eigen::Index>(free.size());
  const Eigen::MatrixXd P_x = cycle.map.next_x(free, free);
  const Eigen::VectorXd l_free =
      (Eigen::MatrixXd::Identity(k, k) - P_x).transpose().partialPivLu().solve(cycle.map.psi_x(free).transpose());
  Eigen::VectorXd l = Eigen::VectorXd::Zero(section.size()), more;
  l(free) = l_free;
  std::vector<double> values;
  const Problem linear = map.linear_problem(cycle.x, cycle.positions, cycle.map, l, values, more);
  const GradientResult g = gradient(linear, name, values);
  r.counters += g.counters;
  r.gradient.assign(g.gradient.begin(), g.gradient.begin() + static_cast<std::ptrdiff_t>(rho.size()));
  for (std::size_t j = 0; j < rho.size(); ++j) r.gradient[j] += more[static_cast<Eigen::Index>(j)];
  return r;
}

}  // namespace costate
