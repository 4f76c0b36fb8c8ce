#include "costate/sensitivity/runge_kutta_discrete.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/analysis/start.h"
#include "costate/base/notice.h"
#include "costate/integrator/integrators.h"
#include "costate/integrator/runge_kutta_run.h"
#include "costate/sensitivity/idle_steps.h"
#include "costate/sensitivity/integrator_gradient.h"

namespace costate {

namespace {

constexpr long kPollStages = 64;  // stages between calls of the monitor

Problem on_scheme(const Problem& problem) {
  Problem p = problem;
  p.solver.integrator = discrete_integrator_of(problem);
  return p;
}

/// Where steps are bounded by something else than their error, no looser run shows what they do.
template <class Kind>
void tell_touches(const RungeKuttaRun<Kind>& run) {
  if (const long cuts = run.steps_cut_at_touches(); cuts > 0)
    notice(fmt::format(
        "{} {} shorter than the steps over {}: they begin and end in the middle of steps, and derivatives of steps are "
        "off by some percent there. Take another method (idas-adjoint, cvodes-adjoint, hand-adjoint), or bound the "
        "steps (run.max_step_s).",
        cuts, cuts == 1 ? "touch was" : "touches were", cuts == 1 ? "it" : "them"));
}

template <class Kind>
double running_and_terminal(System& system, const RungeKuttaRun<Kind>& run, double t) {
  return run.cost() + (system.objective().terminal.empty() ? 0 : system.terminal_cost(t, run.y()));
}

/// The way back over the tape; the gradient gains all but the end's share.
template <class Kind>
class WayBack {
 public:
  using SystemType = typename Kind::SystemType;
  using Tape = typename Kind::Tape;
  using Scheme = typename Kind::Scheme;
  WayBack(SystemType& system, const Problem& problem, Tape& tape, const Scheme& scheme)
      : system_(system), problem_(problem), tape_(tape), scheme_(scheme), adjoint_(system, scheme) {}

  void pass(std::vector<double>& mu, std::vector<double>& gradient) {
    const SolverOptions& o = problem_.solver;
    long evaluations = 0;
    for (long k = tape_.steps() - 1; k >= 0; --k) {
      for (std::size_t j = tape_.jumps_end(k); j-- > tape_.jumps_begin(k);) cross_back(tape_.jump(j), mu, gradient);
      const auto stages = tape_.bring_back(k);
      if (problem_.monitor && (evaluations += scheme_.stages) >= kPollStages) {
        evaluations = 0;
        problem_.monitor(stages.t, tape_.steps() - k, true);
      }
      adjoint_.step_back(stages, mu.data(), gradient.data());
      growth_.look(stages.t, stages.y, mu.data(), system_, o.rtol, o.absolute());
    }
    // Those at the first instant, before any step.
    for (std::size_t j = tape_.steps() > 0 ? tape_.jumps_begin(0) : 0; j-- > 0;)
      cross_back(tape_.jump(j), mu, gradient);
  }
  const AdjointGrowth& growth() const { return growth_; }

 private:
  /// Of a residual's jumps the weights of the differential unknowns are wanted, which need no rates.
  void cross_back(const Jump& jump, std::vector<double>& mu, std::vector<double>& gradient) {
    if constexpr (Kind::implicit) {
      std::vector<double> mup(mu.size(), 0);
      system_.jump_adjoint(jump, mu.data(), mup.data(), gradient.data());
      for (std::size_t i = 0; i < mu.size(); ++i)
        if (!system_.unknowns()[i].differential) mu[i] = 0;
    } else {
      system_.jump_adjoint(jump, mu.data(), gradient.data());
    }
  }

  SystemType& system_;
  const Problem& problem_;
  Tape& tape_;
  const Scheme& scheme_;
  typename Kind::Adjoint adjoint_;
  AdjointGrowth growth_;
};

template <class Kind>
typename Kind::Tape make_tape(typename Kind::SystemType& system, const RungeKuttaRun<Kind>& run,
                              const SolverOptions& o) {
  if constexpr (Kind::implicit)
    return {system, run.scheme(), o.memory_budget_MB * 1e6, o.checkpoint_steps, run.absolute_tolerances()};
  else
    return {system, run.scheme(), o.memory_budget_MB * 1e6, o.checkpoint_steps};
}

/// The weights of the unknowns at the end; the gradient gains the end's own dependence on rho.
void end_weights(OdeSystem& system, double t, const double* y, double* mu, double* gradient) {
  system.terminal_adjoint(t, y, mu, gradient);
}
void end_weights(DaeSystem& system, double t, const double* y, double* mu, double* gradient) {
  system.terminal_cost_gradient(t, y, mu, 1, gradient);
}

template <class Kind>
GradientResult adjoint_once(typename Kind::SystemType& system, const Problem& problem, const std::vector<double>& rho,
                            double asked, double& part, IdleSteps& idle) {
  system.end_at_kinks_of_laws();
  system.differentiate_between_steps();  // what is refused on the way back is refused at once
  system.set_parameters(rho.data());
  const SolverOptions& o = problem.solver;
  RungeKuttaRun<Kind> run(system, o, problem.monitor, StartDerivative::adjoint);
  run.resolve_bends();
  run.resolve_slips();
  run.bound_idle_steps(idle.bound);
  typename Kind::Tape tape = make_tape(system, run, o);
  run.record(&tape);
  RunWatch watch(problem, rho, system);
  watch.begin(o.t_start, run.y());
  run.watch(watch.sink());
  const std::vector<double> start(run.y(), run.y() + system.size());
  run.advance(o.t_end);
  idle.longest = run.idle_step();
  watch.finish(o.t_end, run.y());
  GradientResult r;
  r.integrator = run.scheme().name;
  r.psi = running_and_terminal(system, run, o.t_end);
  r.counters = run.counters();
  r.events = run.events();
  r.gradient.assign(rho.size(), 0);
  std::vector<double> mu(start.size(), 0);
  end_weights(system, o.t_end, run.y(), mu.data(), r.gradient.data());
  AdjointInvariant invariant;
  invariant.end(system, o.t_start, o.t_end, run.y(), mu.data());
  WayBack<Kind> back(system, problem, tape, run.scheme());
  back.pass(mu, r.gradient);
  invariant.start(system, o.t_start, start.data(), mu.data());
  // Last: it leaves the system at no point of the motion.
  const Eigen::MatrixXd& columns = run.start_columns();
  if (columns.size() == 0)
    system.add_start_gradient(o.t_start, mu.data(), r.gradient.data());
  else
    for (std::size_t j = 0; j < rho.size(); ++j)
      for (std::size_t i = 0; i < mu.size(); ++i)
        r.gradient[j] += mu[i] * columns(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  r.counters.backward_steps = tape.steps();
  r.counters.backward_residuals = tape.steps() * run.scheme().stages + tape.evaluations();
  r.counters.checkpoints = tape.checkpoints();
  r.counters.factorizations = system.factorizations();
  r.counters.position_iterations = system.position_iterations();
  watch.conclude(r);
  tell_touches(run);
  idle.judged = true;
  watch.judge(r, back.growth(), invariant);
  part = watch.resolving_part(r, back.growth(), asked);
  return r;
}

template <class Kind>
GradientResult adjoint_of(const Problem& own, const std::vector<double>& rho) {
  const auto system = Kind::make(own);
  return resolved_gradient(own, [&](const Problem& p, double asked, double& part) {
    return settled<Kind>(p, [&](IdleSteps& idle) { return adjoint_once<Kind>(*system, p, rho, asked, part, idle); });
  });
}

template <class Kind>
GradientResult tangent_once(typename Kind::SystemType& system, const Problem& own, const std::vector<double>& rho,
                            IdleSteps& idle) {
  system.end_at_kinks_of_laws();
  system.differentiate_between_steps();
  system.set_parameters(rho.data());
  const SolverOptions& o = own.solver;
  RungeKuttaRun<Kind> run(system, o, own.monitor, StartDerivative::columns);
  run.resolve_bends();
  run.resolve_slips();
  run.bound_idle_steps(idle.bound);
  RunWatch watch(own, rho, system);
  watch.begin(o.t_start, run.y());
  run.watch(watch.sink());
  GradientResult r;
  r.integrator = run.scheme().name;
  r.gradient.assign(rho.size(), 0);
  Eigen::MatrixXd s = run.start_columns();
  [[maybe_unused]] Eigen::MatrixXd sp(s.rows(), s.cols());
  std::vector<double*> columns, rates;
  for (Eigen::Index j = 0; j < s.cols(); ++j) {
    columns.push_back(s.col(j).data());
    rates.push_back(sp.col(j).data());
  }
  typename Kind::Tangent tangent(system, run.scheme());
  const int count = static_cast<int>(columns.size());
  run.follow({[&](const typename Kind::Stages& stages) {
                tangent.step(stages, columns.data(), r.gradient.data());
                r.counters.sensitivity_residuals += run.scheme().stages;
              },
              [&](const Jump& jump) {
                if constexpr (Kind::implicit)
                  system.jump_tangent(jump, columns.data(), rates.data(), count);
                else
                  system.jump_tangent(jump, columns.data(), count);
                const std::vector<double>& cost = system.jump_cost_tangent();
                for (std::size_t j = 0; j < cost.size(); ++j) r.gradient[j] += cost[j];
              }});
  run.advance(o.t_end);
  idle.longest = run.idle_step();
  watch.finish(o.t_end, run.y());
  r.psi = running_and_terminal(system, run, o.t_end);
  if (!system.objective().terminal.empty()) {
    if constexpr (Kind::implicit) {
      std::vector<double> w(static_cast<std::size_t>(system.size()));
      system.terminal_cost_gradient(o.t_end, run.y(), w.data(), 1, r.gradient.data());
      for (std::size_t j = 0; j < rho.size(); ++j)
        for (std::size_t i = 0; i < w.size(); ++i) r.gradient[j] += w[i] * columns[j][i];
    } else {
      std::vector<const double*> in(columns.begin(), columns.end());
      std::vector<double> terminal(rho.size());
      system.tangent_terminal_cost(o.t_end, run.y(), in.data(), terminal.data(), count);
      for (std::size_t j = 0; j < rho.size(); ++j) r.gradient[j] += terminal[j];
    }
  }
  const long evaluations = r.counters.sensitivity_residuals;
  r.counters = run.counters();
  r.counters.sensitivity_residuals = evaluations;
  r.events = run.events();
  watch.conclude(r);
  tell_touches(run);
  return r;
}

template <class Kind>
GradientResult tangent_of(const Problem& own, const std::vector<double>& rho) {
  const auto system = Kind::make(own);
  return settled<Kind>(own, [&](IdleSteps& idle) { return tangent_once<Kind>(*system, own, rho, idle); });
}

}  // namespace

GradientResult runge_kutta_adjoint(const Problem& problem, const std::vector<double>& rho) {
  const Problem own = on_scheme(problem);
  return find_radau_scheme(own.solver.integrator) ? adjoint_of<RadauKind>(own, rho)
                                                  : adjoint_of<ExplicitKind>(own, rho);
}

GradientResult runge_kutta_tangent(const Problem& problem, const std::vector<double>& rho) {
  const Problem own = on_scheme(problem);
  return find_radau_scheme(own.solver.integrator) ? tangent_of<RadauKind>(own, rho)
                                                  : tangent_of<ExplicitKind>(own, rho);
}

}  // namespace costate
