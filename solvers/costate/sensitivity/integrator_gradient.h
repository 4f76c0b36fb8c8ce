// The course of a gradient by an integrator's own sensitivities, the same on IDAS and CVODES: Run is IdaRun or
// CvodeRun.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "costate/base/error.h"
#include "costate/base/unsaid.h"
#include "costate/integrator/run_watch.h"
#include "costate/integrator/sampled_run.h"
#include "costate/integrator/segmented_run.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

/// psi by a run for itself, whose counters are added: while segments are repeated IDAS does not control the error of
/// psi's quadrature (SundialsSession::enable_adjoint), and steps that are long for the motion may be anything to it.
template <class Run, class SystemType>
double psi_alone(SystemType& system, const Problem& problem, Counters& counters) {
  Run run(system, problem.solver, problem.monitor, StartDerivative::none);
  run.enable_cost();
  const double of_samples = advance_over_samples(system, problem, [&](double t, std::size_t) {
    run.advance(t);
    return run.y();
  });
  run.advance(problem.solver.t_end);
  run.read_forward_counters();
  counters += run.counters();
  return run.cost() + of_samples + system.terminal_cost(problem.solver.t_end, run.y());
}

/// Forward run with checkpoints, then the adjoint back; once more with another plan when the first one cannot repeat
/// its segments. `part` is what RunWatch::resolving_part() says of it for the tolerance `asked`.
template <class Run, class SystemType>
GradientResult adjoint_run(SystemType& system, const Problem& problem, const std::vector<double>& rho,
                           const std::string& integrator, double asked, double& part) {
  system.set_parameters(rho.data());
  CheckpointPlan plan = plan_checkpoints(problem.solver, system.size());
  std::optional<double> psi;
  Counters of_psi;
  for (long runs = 1;; ++runs) {
    if (plan.repeats && std::is_same_v<SystemType, DaeSystem> && system.has_running_cost() && !psi) {
      psi = psi_alone<Run>(system, problem, of_psi);
      system.set_parameters(rho.data());
    }
    Run session(system, problem.solver, problem.monitor, StartDerivative::adjoint);
    RunWatch watch(problem, rho, system);
    watch.begin(problem.solver.t_start, session.y());
    // A segment that is repeated must be the same to the bit: where steps are solved for their positions, looking at
    // them in between would not leave it so.
    if (system.begins_with_motion() || !plan.repeats) session.watch(watch.sink());
    session.enable_cost();
    session.enable_adjoint(plan);
    const double of_samples = advance_over_samples(system, problem, [&](double t, std::size_t index) {
      session.advance_with_checkpoints(t);
      session.keep_sample(index);
      return session.y();
    });
    session.advance_with_checkpoints(problem.solver.t_end);
    session.read_forward_counters();  // after the backward run they describe the last segment's repetition
    if (session.outgrew_plan() && !plan.repeats) {
      plan = plan_again(problem.solver, system.size(), session.longest_segment());
      continue;
    }
    watch.finish(problem.solver.t_end, session.y());
    GradientResult r;
    r.integrator = integrator;
    r.psi = psi ? *psi : session.cost() + of_samples + system.terminal_cost(problem.solver.t_end, session.y());
    try {
      r.gradient = session.solve_adjoint(sample_adjoint(system));
    } catch (const SolverError&) {
      watch.tell_of_motion();
      throw;
    }
    r.counters = session.counters();
    r.events = session.events();
    r.counters.simulations = runs;
    r.counters += of_psi;
    watch.conclude(r);
    watch.judge(r, session.adjoint_growth(), session.invariant());
    part = watch.resolving_part(r, session.adjoint_growth(), asked);
    return r;
  }
}

/// An adjoint run, run(problem, asked, part), and with smaller tolerances again where the gradient turns out to be
/// small against its errors: a derivative is what is left of terms of the adjoint's size, each of which is known to the
/// tolerance. Without SolverOptions::resolve once, and nothing is said of it: the caller looks at errors itself.
template <class AdjointRun>
GradientResult resolved_gradient(const Problem& problem, const AdjointRun& run) {
  constexpr double kResolved = 0.3;
  const double asked = problem.solver.rtol;
  double part = 1;
  if (!problem.solver.resolve) return run(problem, asked, part);
  const OwnNotices notices;
  GradientResult r = run(problem, asked, part);
  // Of what is nothing a smaller tolerance tells nothing either: a motion at rest makes it of rounding.
  const double size = std::max(std::abs(r.psi), largest_scaled(problem.parameters, r.gradient));
  if (part < 1 && size > negligible_cost(problem)) {
    Problem finer = problem;
    finer.solver.tighten(part, 0);
    const std::vector<std::string> said = take_notices();
    try {
      const GradientResult first = r;
      r = run(finer, asked, part);
      r.counters.simulations += first.counters.simulations;
    } catch (const SolverError&) {  // the smaller tolerance is out of reach
      notices.forget();
      for (const auto& text : said) notice(text);
    }
  }
  if (part < kResolved) tell_unresolved(problem, r, part);
  return r;
}

template <class Run, class SystemType>
GradientResult adjoint_gradient(SystemType& system, const Problem& problem, const std::vector<double>& rho,
                                const std::string& integrator) {
  return resolved_gradient(problem, [&](const Problem& p, double asked, double& part) {
    return adjoint_run<Run>(system, p, rho, integrator, asked, part);
  });
}

/// One forward run of the state and its sensitivities; `more` goes to the sessions.
template <class Run, class SystemType, class... More>
GradientResult forward_gradient(SystemType& system, const Problem& problem, const std::vector<double>& rho,
                                const std::string& integrator, More... more) {
  system.set_parameters(rho.data());
  Run session(system, problem.solver, problem.monitor, StartDerivative::columns, more...);
  RunWatch watch(problem, rho, system);
  watch.begin(problem.solver.t_start, session.y());
  session.watch(watch.sink());
  GradientResult r;
  r.integrator = integrator;
  session.enable_cost();
  session.enable_sensitivities();
  std::vector<double> by_samples(rho.size(), 0);
  const double of_samples = advance_over_samples(
      system, problem,
      [&](double t, std::size_t) {
        session.advance(t);
        return session.y();
      },
      [&] {
        const std::vector<double> g = session.terminal_gradient();
        for (std::size_t j = 0; j < g.size(); ++j) by_samples[j] += g[j];
      });
  session.advance(problem.solver.t_end);
  watch.finish(problem.solver.t_end, session.y());
  r.psi = session.cost() + of_samples + system.terminal_cost(problem.solver.t_end, session.y());
  r.gradient = session.sensitivity_gradient();
  for (std::size_t j = 0; j < rho.size(); ++j) r.gradient[j] += by_samples[j];
  session.read_forward_counters();
  r.counters = session.counters();
  r.events = session.events();
  watch.conclude(r);
  return r;
}

}  // namespace costate
