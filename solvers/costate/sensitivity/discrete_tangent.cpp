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
  CutCrossing crossing(run.scheme());
  GradientResult r;
  r.integrator = "fixed";
  r.gradient.assign(rho.size(), 0.0);
  std::vector<double> here(rho.size());  // the running cost's, at the last node
  std::vector<Eigen::RowVectorXd> times;
  Eigen::RowVectorXd dt = Eigen::RowVectorXd::Zero(static_cast<Eigen::Index>(rho.size()));  // of the last cut
  FixedRun::Follower follower;
  follower.step = [&](long k, const StepCut* begun) {
    if (k == 0) return tangent.start();
    tangent.step();
    if (begun) tangent.add(begun->next_by_beginning, -dt);
  };
  follower.cut = [&](const StepCut& cut) {
    if (cut.instant) tangent.add(cut.by_end, -dt);
    dt = crossing.time_change(cut, tangent);
    tangent.add(cut.by_end, dt);
    times.push_back(dt);
  };
  follower.behind = [&](const StepCut& cut) { crossing.pass(cut, dt, tangent); };
  follower.node = [&] {
    std::fill(here.begin(), here.end(), 0.0);
    tangent.add_running_cost(1, here.data());
  };
  follower.weigh = [&](double weight) {
    for (std::size_t j = 0; j < here.size(); ++j) r.gradient[j] += weight * here[j];
  };
  r.psi = run.forward(follower);
  for (std::size_t i = 0; i < times.size(); ++i)
    for (std::size_t j = 0; j < rho.size(); ++j)
      r.gradient[j] += run.cuts()[i].cost_rate * times[i][static_cast<Eigen::Index>(j)];
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
