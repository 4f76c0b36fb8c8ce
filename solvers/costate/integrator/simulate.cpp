#include "costate/integrator/simulate.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <type_traits>

#include "costate/base/error.h"
#include "costate/discrete/step_interpolant.h"
#include "costate/formulation/solved_state.h"
#include "costate/integrator/cost_domain.h"
#include "costate/integrator/fixed_run.h"
#include "costate/integrator/run_end.h"
#include "costate/integrator/run_watch.h"
#include "costate/integrator/runge_kutta_run.h"
#include "costate/integrator/sampled_run.h"
#include "costate/integrator/segmented_run.h"

namespace costate {

namespace {

/// By fixed steps; samples between them by interpolation.
Simulation simulate_fixed(const Problem& problem, const std::vector<double>& rho, const std::vector<double>& times,
                          const SampleSink& sink) {
  FixedRun run(problem, rho, fixed_steps(problem), StartDerivative::none);
  StepInterpolant between(run.scheme());
  std::size_t next = 0;
  double last = -std::numeric_limits<double>::infinity();
  Simulation r;
  const auto sample = [&](double t) {
    const double end = run.scheme().time();
    sink(between.at(std::min(t, end)), run.scheme());
    last = t;
  };
  FixedRun::Follower follower;
  follower.step = [&](long, const StepCut*) {
    between.advance();
    for (; sink && next < times.size() && times[next] <= run.scheme().time(); ++next) sample(times[next]);
  };
  follower.behind = [&](const StepCut&) { between.begin_anew(); };
  r.psi = run.forward(follower);
  // The last time but for rounding; or the end that an event has made.
  if (sink && !run.end() && next < times.size()) sample(times[next]);
  if (sink && run.end() && !times.empty() && last < run.scheme().time()) sample(run.scheme().time());
  r.counters = run.counters();
  run.conclude(r);
  return r;
}

template <class Run, class SystemType>
Simulation run(SystemType& system, const Problem& problem, const std::vector<double>& rho,
               const std::vector<double>& times, const SampleSink& sink) {
  if constexpr (std::is_same_v<Run, RadauRun>) system.end_at_kinks_of_laws();
  system.set_parameters(rho.data());
  Run session(system, problem.solver, problem.monitor, StartDerivative::none);
  if constexpr (std::is_same_v<Run, RadauRun>) session.resolve_bends();
  if constexpr (std::is_same_v<Run, ExplicitRun>) session.follow_bends();
  RunWatch watch(problem, rho, system);
  watch.begin(problem.solver.t_start, session.y());
  std::optional<EndWatch> end;
  if (problem.ends_when) {
    end.emplace(problem, system);
    end->begin(session.y());
  }
  session.watch(end ? end->sink(watch.sink()) : watch.sink());
  session.enable_cost();
  // To t, or to the end of a run that has one of its own: then false.
  const auto advance = [&](double t) {
    if (end) return end->advance(session, t);
    session.advance(t);
    return true;
  };
  // What samples take is no work of the run: its counters are the same whatever is stored.
  long factorizations = 0, position_iterations = 0;
  const auto sample = [&](double t) {
    if (!sink) return;
    const long f = system.factorizations(), i = system.position_iterations();
    watch.sample(t, session.y());
    sink(solved_state(system, t, session.y()), system);
    factorizations += system.factorizations() - f;
    position_iterations += system.position_iterations() - i;
  };
  double last = -std::numeric_limits<double>::infinity(), t_end = problem.solver.t_end;
  std::size_t next = 0;
  const auto sample_until = [&](double t) {
    for (; next < times.size() && times[next] <= t; ++next) {
      if (!advance(times[next])) return;
      sample(last = times[next]);
    }
  };
  const double of_samples = advance_over_samples(system, problem, [&](double t, std::size_t) {
    sample_until(t);
    advance(t);
    return session.y();
  });
  sample_until(std::numeric_limits<double>::infinity());
  advance(t_end);
  Simulation r;
  if (end) {
    t_end = end->time();
    if (last < t_end && !times.empty()) sample(t_end);
    r.end = end->event();
  }
  watch.finish(t_end, session.y());
  if (end) end->tell_if_grazed(session.y());
  r.psi = session.cost() + of_samples;
  if (!system.objective().terminal.empty()) r.psi += system.terminal_cost(t_end, session.y());
  session.read_forward_counters();
  r.counters = session.counters();
  r.events = session.events();
  r.counters.factorizations -= factorizations;
  r.counters.position_iterations -= position_iterations;
  watch.conclude(r);
  return r;
}

void check_times(const SolverOptions& o, const std::vector<double>& times) {
  const double rounding = 1e-12 * std::max(std::abs(o.t_start), std::abs(o.t_end));
  for (std::size_t i = 0; i < times.size(); ++i)
    if (!(times[i] >= o.t_start - rounding && times[i] <= o.t_end + rounding) || (i > 0 && times[i] < times[i - 1]))
      throw Error(fmt::format("Sample time {} is {} s; times within the run's {} .. {} s are expected, in order.", i,
                              times[i], o.t_start, o.t_end));
}

Simulation simulate_by(const std::string& integrator, const Problem& problem, const std::vector<double>& rho,
                       const std::vector<double>& times, const SampleSink& sink) {
  Simulation r;
  if (integrator == "idas") {
    const Problem separate = with_separate_samples(problem);
    const auto system = separate.make_dae();
    r = run<IdaRun>(*system, separate, rho, times, sink);
  } else if (integrator == "fixed") {
    r = simulate_fixed(problem, rho, times, sink);
  } else if (find_explicit_scheme(integrator)) {
    const Problem separate = with_separate_samples(problem);
    r = run<ExplicitRun>(*separate.make_ode(), separate, rho, times, sink);
  } else if (find_radau_scheme(integrator)) {
    const Problem separate = with_separate_samples(problem);
    r = run<RadauRun>(*separate.make_dae(), separate, rho, times, sink);
  } else {
    // A second attempt goes on with the samples that the first one has not handed out.
    std::ptrdiff_t handed_out = 0;
    const SampleSink once = [&](const MechanismState& state, System& system) {
      ++handed_out;
      sink(state, system);
    };
    r = with_bdf_where_stiff(with_separate_samples(problem), [&](const Problem& p) {
      const auto system = p.make_ode();
      return run<CvodeRun>(*system, p, rho, std::vector<double>(times.begin() + handed_out, times.end()),
                           sink ? once : sink);
    });
  }
  r.integrator = integrator;
  return r;
}

}  // namespace

Simulation simulate(const Problem& problem, const std::vector<double>& rho, const std::vector<double>& times,
                    const SampleSink& sink) {
  problem.check_values(rho);
  check_times(problem.solver, times);
  const std::string integrator = integrator_of(problem);
  return with_cost_told(problem, rho, [&] { return simulate_by(integrator, problem, rho, times, sink); });
}

}  // namespace costate
