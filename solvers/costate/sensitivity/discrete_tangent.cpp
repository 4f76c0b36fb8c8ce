// Method "discrete-tangent": the exact derivative of a run by fixed steps or by a Runge-Kutta scheme with step control,
// one column a parameter beside the run.
#include "costate/integrator/fixed_run.h"
#include "costate/integrator/integrators.h"
#include "costate/sensitivity/method.h"
#include "costate/sensitivity/runge_kutta_discrete.h"

namespace costate {
namespace {

GradientResult run_discrete_tangent_steps(const Problem& problem, const std::vector<double>& rho, long steps) {
  FixedRun run(problem, rho, steps, StartDerivative::columns);
  DiscreteTangent tangent(run.scheme());
  GradientResult r;
  r.integrator = "fixed";
  r.gradient.assign(rho.size(), 0.0);
  r.psi = run.forward([&](long k) {
    if (k == 0)
      tangent.start();
    else
      tangent.step();
    tangent.add_running_cost(run.weight(k), r.gradient.data());
  });
  tangent.add_terminal_cost(r.gradient.data());
  r.counters = run.counters();
  run.conclude(r);
  return r;
}

GradientResult run_discrete_tangent(const Problem& problem, const std::vector<double>& rho) {
  if (!has_fixed_steps(discrete_integrator_of(problem))) return runge_kutta_tangent(problem, rho);
  return settle_gradient(problem, [&](long steps) { return run_discrete_tangent_steps(problem, rho, steps); });
}

const RegisterSensitivityMethod discrete_tangent_registered({
    .name = "discrete-tangent",
    .summary = "exact tangent of the steps (fixed, or Runge-Kutta): psi's own gradient, to rounding",
    .needs = SensitivityMethod::Needs::discrete,
    .gradient = run_discrete_tangent,
});

}  // namespace
}  // namespace costate
