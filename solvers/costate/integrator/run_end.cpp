#include "costate/integrator/run_end.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"
#include "costate/integrator/fixed_run.h"
#include "costate/integrator/runge_kutta_run.h"
#include "costate/integrator/segmented_run.h"
#include "costate/integrator/simulate.h"
#include "costate/level/acceleration_rates.h"
#include "costate/level/penalty_weight.h"

namespace costate {

namespace {

// With R = |h'| (te - t0) over the range of h, an error e of h (in parts of that range) moves the end by e/R of the
// run, and changes h', so the gradient, by some e/R^2 of itself. Below the one R, or with rtol for e above the one
// part, a gradient is refused; above the other part it is told.
// A simulation tells from this R on, where its end has two digits less than the motion, whose errors are up to some
// hundred tolerances.
constexpr double kHardlyCrossed = 1e-2, kRunErrors = 100;
// From this R on errors make hardly more of it than of anything else, whatever the tolerance.
constexpr double kCrossed = 0.3;
constexpr double kGrazedEnd = 1e-7, kNoGradientOfEnd = 1e-3, kFewDigitsOfEnd = 1e-5;

// An event of the motion that comes with the end lies behind it. A run to the end's time alone meets it where its own
// errors have it, so that none is looked for from this part of the run before the end on: in tolerances, bounded.
constexpr double kBeforeEnd = 10, kLeastBeforeEnd = 1e-6, kMostBeforeEnd = 1e-3;

struct RunEnd {
  double t;          // s
  double kappa = 0;  // of end_term()
  std::optional<RunEvent> last_event = {};
  std::vector<double> kinks = {};  // of drivers
};

double events_until(const Problem& problem, const RunEnd& end) {
  return end.t - std::clamp(kBeforeEnd * problem.solver.rtol, kLeastBeforeEnd, kMostBeforeEnd) *
                     (end.t - problem.solver.t_start);
}

}  // namespace

Eigen::VectorXd reaction_rates(const Problem& problem, const StateView& s, Assembly& assembly) {
  // A penalty's reactions are those of its own weight. Rows that depend on each other leave the sum of their
  // multipliers' rates, which a weight shares among them.
  const Formulation& f = find_formulation(problem.formulation);
  Stabilization weight;
  if (!f.exact_constraints())
    weight = penalty_stabilization(problem.mechanism, problem.formulation_options);
  else if (f.carries_redundancy)
    weight.inverse_alpha = 1 / default_penalty_weight(problem.mechanism);
  AccelerationLevel level(assembly, weight);
  level.solve(s);
  level.linearize();
  return acceleration_rates(assembly, level);
}

namespace {

template <class Run, class SystemType>
RunEnd search_end(SystemType& system, const Problem& problem, const std::vector<double>& rho, bool rates_too) {
  if constexpr (std::is_same_v<Run, RadauRun>) system.end_at_kinks_of_laws();
  system.set_parameters(rho.data());
  Run run(system, problem.solver, problem.monitor, StartDerivative::none);
  if constexpr (std::is_same_v<Run, RadauRun>) run.resolve_bends();
  if constexpr (std::is_same_v<Run, ExplicitRun>) run.follow_bends();
  EndWatch watch(problem, system);
  watch.begin(run.y());
  run.watch(watch.sink());
  run.enable_cost();  // so that its steps are those of the run itself, and jumps have it
  watch.advance(run, problem.solver.t_end);
  RunEnd end{watch.time()};
  if (!run.events().empty()) end.last_event = run.events().back();
  end.kinks = driver_kinks(*problem.mechanism, system.assembly().numbers());
  if (!rates_too) return end;
  const MechanismState s = solved_state(system, watch.time(), run.y());
  const bool of_reactions =
      problem.ends_when->output->needs_accelerations() || problem.objective.terminal_needs_accelerations();
  const EndRates rates = end_rates(*problem.ends_when, problem.objective, s, system.assembly(),
                                   of_reactions ? reaction_rates(problem, s, system.assembly()) : Eigen::VectorXd());
  judge_end(problem, system.assembly(), watch.time(), rates.h_rate, watch.steepness(rates.h_rate));
  end.kappa = rates.kappa;
  return end;
}

/// Which end their run themselves.
RunEnd end_of_fixed_steps(const Problem& problem, const std::vector<double>& rho) {
  FixedRun run(problem, rho, fixed_steps(problem), StartDerivative::none);
  run.forward();
  RunEnd end{run.end()->t};
  if (!run.events().empty()) end.last_event = run.events().back();
  return end;
}

RunEnd search_end(const Problem& problem, const std::vector<double>& rho, const std::string& integrator, bool rates) {
  const std::string on = integrator.empty() ? integrator_of(problem) : integrator;
  if (on == "fixed") return end_of_fixed_steps(problem, rho);
  if (on == "idas") return search_end<IdaRun>(*problem.make_dae(), problem, rho, rates);
  Problem p = problem;
  p.solver.integrator = on;
  if (find_explicit_scheme(on)) return search_end<ExplicitRun>(*p.make_ode(), p, rho, rates);
  if (find_radau_scheme(on)) return search_end<RadauRun>(*p.make_dae(), p, rho, rates);
  return with_bdf_where_stiff(problem,
                              [&](const Problem& q) { return search_end<CvodeRun>(*q.make_ode(), q, rho, rates); });
}

}  // namespace

EndWatch::EndWatch(const Problem& problem, System& system)
    : problem_(problem), system_(system), search_(*problem.ends_when, problem.solver.t_start) {}

MechanismState EndWatch::state(double t, const double* y) {
  return problem_.ends_when->output->needs_accelerations() ? solved_state(system_, t, y) : system_.look_state(t, y);
}

void EndWatch::begin(const double* y) { search_.begin(state(problem_.solver.t_start, y), system_.assembly()); }

StepSink EndWatch::sink(StepSink other) {
  return [this, other = std::move(other)](double t, const double* y) {
    if (other) other(t, y);
    if (!end_ && search_.step(state(t, y), system_.assembly())) throw Look{};
  };
}

void EndWatch::look(const std::function<const double*(double)>& at) {
  end_ = search_.find([&](double t) { return problem_.ends_when->distance(state(t, at(t)), system_.assembly()); });
}

RunEvent EndWatch::event() const { return {*end_, problem_.ends_when->text(system_.assembly())}; }

void EndWatch::tell_if_grazed(const double* y) {
  const MechanismState s = solved_state(system_, *end_, y);
  const double rate =
      end_rate(*problem_.ends_when, s, system_.assembly(), reaction_rates(problem_, s, system_.assembly()));
  tell_hardly_crossed(problem_, system_.assembly(), *end_, rate, steepness(rate));
}

void tell_hardly_crossed(const Problem& problem, const Assembly& assembly, double t, double rate, double steep) {
  if (!(steep < kHardlyCrossed)) return;
  // Errors of that part of the range move it by as much over the steepness, or, where it turns there, by their root.
  const double rtol = problem.solver.rtol, error = kRunErrors * rtol,
               part = std::min(error / std::max(steep, error), std::sqrt(error));
  notice(fmt::format(
      "The run's end is hardly crossed: at t = {:.9g} s {} comes with a rate of {:.3g} {}/s, and what a run may be off "
      "by at rtol {:g} moves it by some {:.1g} s, or decides whether it comes. Move the level away from there, or take "
      "a smaller rtol.",
      t, problem.ends_when->text(assembly), rate, problem.ends_when->output->unit(), rtol,
      part * (t - problem.solver.t_start)));
}

void judge_end(const Problem& problem, const Assembly& assembly, double t, double rate, double steepness) {
  if (steepness >= kCrossed) return;
  const auto text = [&] {
    return fmt::format(
        "The run's end is hardly crossed: at t = {:.9g} s {} comes with a rate of {:.3g} {}/s, {:.1e} of what it "
        "ranges over in a run's length",
        t, problem.ends_when->text(assembly), rate, problem.ends_when->output->unit(), steepness);
  };
  const double part = problem.solver.rtol / (steepness * steepness);
  if (!(steepness > kGrazedEnd) || part > kNoGradientOfEnd)
    throw SolverError(
        text() + ". Where an end is grazed its time has no derivative. Move the level, or the motion, away from it.");
  if (part > kFewDigitsOfEnd)
    notice(text() + fmt::format(": errors of the size of the tolerance (rtol {:g}) change the gradient by {:.0e} of "
                                "itself. Move the level away from there, or take a smaller rtol.",
                                problem.solver.rtol, part));
}

double EndWatch::steepness(double rate) const {
  return std::abs(rate) * (*end_ - problem_.solver.t_start) / search_.range();
}

void EndWatch::never() const { fail_without_end(problem_, search_, system_.assembly()); }

void fail_without_end(const Problem& problem, const EndSearch& search, const Assembly& assembly) {
  const EndEvent& end = *problem.ends_when;
  const std::string what = end.text(assembly), unit = end.output->unit();
  const char *from = end.above ? "below" : "above", *way = end.above ? "rise" : "fall";
  if (!search.armed())
    throw NoEndError(fmt::format(
        "The run ends by {}, which the output is, or is at, from the start to t_end_s = {:g} s: it never comes from {} "
        "the level, to {} to it. Take the other one of 'above' and 'below', another level (one that it does not rest "
        "at), or another output (a gap in the place of a force that is zero while it is open).",
        what, problem.solver.t_end, from, way));
  if (!std::isfinite(search.nearest()))
    throw NoEndError(fmt::format(
        "The run ends by {}, which never comes before t_end_s = {:g} s: the output begins beyond the level, "
        "passes it the other way, and does not turn. Take the other one of 'above' and 'below', or a later "
        "t_end_s.",
        what, problem.solver.t_end));
  throw NoEndError(
      fmt::format("The run ends by {}, which never comes before t_end_s = {:g} s. It is nearest at t = {:.6g} s, where "
                  "{:.6g} {} are "
                  "missing. Take a later t_end_s, or a level that the motion reaches.",
                  what, problem.solver.t_end, search.nearest_time(), search.nearest(), unit));
}

void refuse_free_end(const Problem& problem, const std::string& what) {
  if (!problem.ends_when) return;
  throw CapabilityError(fmt::format(
      "The run's end is that of an event ('ends_when' in [run]), which {} not made for yet; simulations and "
      "gradients on idas and cvodes, or by Runge-Kutta schemes, are. Without 'ends_when' the run goes to t_end_s.",
      what));
}

Problem with_fixed_end(const Problem& problem, const std::vector<double>& rho, const std::string& integrator) {
  if (!problem.ends_when) return problem;
  const RunEnd end = search_end(problem, rho, integrator, true);
  Problem fixed = problem;
  fixed.ends_when.reset();
  fixed.solver.t_end = end.t;
  fixed.solver.events_until = events_until(problem, end);
  if (end.last_event && end.last_event->t >= fixed.solver.events_until)
    throw SolverError(
        fmt::format("'{}' happens at t = {:.9g} s, at the end of the run itself ({:.9g} s, 'ends_when'): which of them "
                    "comes first is not known well enough for a derivative. Move the level.",
                    end.last_event->name, end.last_event->t, end.t));
  for (const double kink : end.kinks)
    if (std::abs(kink - end.t) <= end.t - fixed.solver.events_until)
      throw SolverError(
          fmt::format("The law of a driver has a kink at t = {:.9g} s, where velocities jump, at the end of the run "
                      "itself ({:.9g} s, 'ends_when'): which of them comes first is not known well enough for a "
                      "derivative. Move the level.",
                      kink, end.t));
  fixed.objective.followed.push_back(problem.ends_when->output);
  fixed.objective.terminal.push_back(end_term(*problem.ends_when, end.kappa));
  return fixed;
}

Problem until_its_end(const Problem& problem, const std::vector<double>& rho) {
  if (!problem.ends_when) return problem;
  Problem fixed = problem;
  fixed.ends_when.reset();
  const RunEnd end = search_end(problem, rho, "", false);
  fixed.solver.t_end = end.t;
  if (const double until = events_until(problem, end); !end.last_event || end.last_event->t < until)
    fixed.solver.events_until = until;
  return fixed;
}

}  // namespace costate
