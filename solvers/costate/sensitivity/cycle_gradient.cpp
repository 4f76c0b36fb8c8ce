#include "costate/sensitivity/cycle_gradient.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/cycle/cycle.h"
#include "costate/cycle/cycle_start.h"
#include "costate/cycle/multiplier_derivative.h"
#include "costate/problem/known_error.h"
#include "costate/sensitivity/cycle_lagrangian.h"
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

/// A cost with the largest multiplier has a gradient that is not exact to rounding, and says so. This is a part of its
/// error, no estimate of all of it: the cycle's runs have theirs.
void tell_multiplier(double factor, const Eigen::VectorXd& error, const std::string& how, GradientResult& r) {
  std::vector<double> of;
  for (const double e : error) of.push_back(std::abs(factor) * e);
  widen_error(r, 0, of);
  notice(fmt::format("The derivative of cycle.multiplier is by {}.", how));
}

}  // namespace

Simulation cycle_run(const Problem& problem, const std::vector<double>& rho) {
  CycleOptions options;
  options.estimate = options.derivatives = false;
  Simulation r;
  describe(find_cycle(problem, *problem.cycle, rho, options), problem, r);
  return r;
}

std::pair<Problem, std::vector<double>> shown_motion(const Problem& problem, const std::vector<double>& rho) {
  if (!problem.cycle) return {problem, rho};
  CycleOptions options;
  options.estimate = options.derivatives = false;
  const CycleResult cycle = find_cycle(problem, *problem.cycle, rho, options);
  const CycleStart start(problem, *problem.cycle, rho);
  std::vector<double> values;
  Problem p = ReturnMap(problem, start.section(), rho).motion_from(cycle.x, cycle.positions, values);
  p.objective = {};
  p.solver.t_end = problem.solver.t_end;
  return {p, values};
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
  const auto np = static_cast<std::ptrdiff_t>(rho.size());
  const double by_multiplier = cycle.psi_values[kCycleMultiplier];
  if (options.derivatives) {
    r.gradient.assign(cycle.psi_rho.data(), cycle.psi_rho.data() + np);
    if (by_multiplier != 0) tell_multiplier(by_multiplier, cycle.multiplier_rho_error, cycle.multiplier_method, r);
    return r;
  }
  const CycleLagrangian lagrangian(p, rho, cycle);
  const ReturnMap& map = lagrangian.map();
  Eigen::VectorXd more;
  std::vector<double> values;
  const Problem linear = map.linear_problem(cycle.x, cycle.positions, cycle.map, lagrangian.weights(), values, more);
  const GradientResult g = gradient(linear, name, values);
  r.counters += g.counters;
  r.gradient.assign(g.gradient.begin(), g.gradient.begin() + np);
  for (std::size_t j = 0; j < rho.size(); ++j) r.gradient[j] += more[static_cast<Eigen::Index>(j)];
  if (g.known_error) widen_error(r, 0, g.known_error->gradient);
  if (by_multiplier != 0) {
    const MultiplierDerivative m = multiplier_derivative(map, cycle.x, cycle.positions, static_cast<int>(np));
    r.counters += m.counters;
    for (std::size_t j = 0; j < rho.size(); ++j)
      r.gradient[j] += by_multiplier * m.by_rho[static_cast<Eigen::Index>(j)];
    tell_multiplier(by_multiplier, m.error, multiplier_method(m), r);
  }
  return r;
}

}  // namespace costate
