// Method "discrete-adjoint": the exact adjoint of a run by fixed steps or by a Runge-Kutta scheme with step control,
// one pass back whatever the number of parameters.
#include "costate/integrator/fixed_run.h"
#include "costate/integrator/integrators.h"
#include "costate/sensitivity/method.h"
#include "costate/sensitivity/runge_kutta_discrete.h"

namespace costate {
namespace {

GradientResult run_discrete_adjoint_steps(const Problem& problem, const std::vector<double>& rho, long steps) {
  FixedRun run(problem, rho, steps, StartDerivative::adjoint);
  StepArchive archive(run.scheme(), run.expected_steps(), problem.solver.memory_budget_MB * 1e6,
                      problem.solver.checkpoint_steps);
  GradientResult r;
  r.integrator = "fixed";
  FixedRun::Follower follower;
  follower.step = [&](long, const StepCut*) { archive.keep(); };
  follower.behind = [&](const StepCut&) { archive.keep_behind_cut(); };
  r.psi = run.forward(follower);
  DiscreteAdjoint adjoint(run.scheme());
  r.gradient = run.backward(archive, adjoint);
  r.counters = run.counters();
  run.conclude(r);
  return r;
}

GradientResult run_discrete_adjoint(const Problem& problem, const std::vector<double>& rho) {
  if (!has_fixed_steps(discrete_integrator_of(problem))) return runge_kutta_adjoint(problem, rho);
  return settle_gradient(problem, [&](long steps) { return run_discrete_adjoint_steps(problem, rho, steps); });
}

const RegisterSensitivityMethod discrete_adjoint_registered({
    .name = "discrete-adjoint",
    .summary = "exact adjoint of the steps (fixed, or Runge-Kutta): one pass back for all parameters",
    .needs = SensitivityMethod::Needs::discrete,
    .gradient = run_discrete_adjoint,
    .adjoint = true,
    .keeps_checkpoints = true,
});

}  // namespace
}  // namespace costate
