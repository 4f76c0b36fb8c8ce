// The course of a gradient by an integrator's own sensitivities, the same on IDAS and CVODES: Run is IdaRun or
// CvodeRun.
#pragma once

#include <string>

#include "costate/integrator/run_watch.h"
#include "costate/integrator/segmented_run.h"

namespace costate {

/// Forward run with checkpoints, then the adjoint back; once more with another plan when the first one cannot repeat
/// its segments, and once with smaller tolerances where the gradient turns out to be small against its errors.
template <class Run, class SystemType>
GradientResult adjoint_gradient(SystemType& system, const Problem& problem, const std::vector<double>& rho,
                                const std::string& integrator) {
  system.set_parameters(rho.data());
  Problem run = problem;
  CheckpointPlan plan = plan_checkpoints(run.solver, system.size());
  for (long runs = 1;; ++runs) {
    Run session(system, run.solver, run.monitor, true);
    RunWatch watch(run, rho, system);
    watch.begin(run.solver.t_start, session.y());
    // A segment that is repeated must be the same to the bit: where steps are solved for their positions, looking at
    // them in between would not leave it so.
    if (system.begins_with_motion() || !plan.repeats) session.watch(watch.sink());
    session.enable_cost();
    session.enable_adjoint(plan);
    session.advance_with_checkpoints(run.solver.t_end);
    session.read_forward_counters();  // after the backward run they describe the last segment's repetition
    if (session.counters().checkpoints > 0 && !plan.repeats) {
      plan = plan_again(run.solver, system.size(), session.counters().steps);
      continue;
    }
    watch.finish(run.solver.t_end, session.y());
    GradientResult r;
    r.integrator = integrator;
    r.psi = session.cost() + system.terminal_cost(run.solver.t_end, session.y());
    r.gradient = session.solve_adjoint();
    r.counters = session.counters();
    r.events = session.events();
    r.counters.simulations = runs;
    if (getenv("K_DEBUG")) {
      double g = 0;
      for (std::size_t j = 0; j < r.gradient.size(); ++j)
        g = std::max(g, std::abs(r.gradient[j]) * problem.parameters.parameters[j].scale);
      fprintf(stderr, "K %s rtol %.1e psi %.3e g %.3e growth/rtol %.3e ratio %.3e\n", problem.formulation.c_str(),
              run.solver.rtol, r.psi, g, session.adjoint_growth().change() / run.solver.rtol,
              session.adjoint_growth().change() / g);
    }
    const double part = watch.resolving_part(r, session.adjoint_growth());
    if (part < 1 && run.solver.rtol == problem.solver.rtol &&
        session.counters().steps < problem.solver.max_steps / 10) {
      run.solver.atol = part * run.solver.absolute();
      run.solver.rtol *= part;
      plan = plan_checkpoints(run.solver, system.size());
      continue;
    }
    watch.conclude(r);
    watch.judge(r, session.adjoint_growth(), session.invariant());
    return r;
  }
}

/// One forward run of the state and its sensitivities; `more` goes to the sessions.
template <class Run, class SystemType, class... More>
GradientResult forward_gradient(SystemType& system, const Problem& problem, const std::vector<double>& rho,
                                const std::string& integrator, More... more) {
  system.set_parameters(rho.data());
  Run session(system, problem.solver, problem.monitor, true, more...);
  RunWatch watch(problem, rho, system);
  watch.begin(problem.solver.t_start, session.y());
  session.watch(watch.sink());
  GradientResult r;
  r.integrator = integrator;
  session.enable_cost();
  session.enable_sensitivities();
  session.advance(problem.solver.t_end);
  watch.finish(problem.solver.t_end, session.y());
  r.psi = session.cost() + system.terminal_cost(problem.solver.t_end, session.y());
  r.gradient = session.sensitivity_gradient();
  session.read_forward_counters();
  r.counters = session.counters();
  r.events = session.events();
  watch.conclude(r);
  return r;
}

}  // namespace costate
