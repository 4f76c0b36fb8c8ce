#include "costate/cycle/map_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "costate/base/error.h"
#include "costate/integrator/run_end.h"
#include "costate/integrator/run_watch.h"
#include "costate/integrator/segmented_run.h"
#include "costate/integrator/simulate.h"
#include "costate/integrator/stiffness_watch.h"

namespace costate {

namespace {

// As for ends of runs (integrator/run_end.cpp): below the one steepness, or with more of itself than the other part
// that errors of the tolerance change a derivative by, there is none.
constexpr double kGrazed = 1e-7, kNoDerivative = 1e-3;
// The part of the span within which a run that begins on its section does not end there.
constexpr double kAtStart = 1e-6;

/// w + kappa h, with w one of several: the terminal cost of a run that is asked for the derivatives of all of them.
class ChosenTerm final : public CostTerm {
 public:
  std::vector<std::shared_ptr<const CostTerm>> psi;  // the problem's own
  std::shared_ptr<const CostTerm> end;               // h, or null
  struct {
    const Output* output = nullptr;
    bool psi = false;
    double kappa = 0;
  } chosen;

  double value(const StateView& s, Assembly& assembly) const override {
    double sum = chosen.output ? chosen.output->value(s, assembly) : 0;
    if (chosen.psi)
      for (const auto& term : psi) sum += term->value(s, assembly);
    return sum;
  }
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override {
    if (chosen.output) chosen.output->add_gradient(s, assembly, factor, g);
    if (chosen.psi)
      for (const auto& term : psi) term->add_gradient(s, assembly, factor, g);
    if (end && chosen.kappa != 0) end->add_gradient(s, assembly, factor * chosen.kappa, g);
  }
  bool needs_accelerations() const override {
    if (chosen.output && chosen.output->needs_accelerations()) return true;
    if (end && chosen.kappa != 0 && end->needs_accelerations()) return true;
    if (chosen.psi)
      for (const auto& term : psi)
        if (term->needs_accelerations()) return true;
    return false;
  }
};

/// The first step that ends after `t` has been made.
struct Passed {
  double t;
};

template <class Run, class SystemType, class... More>
MapRun run(SystemType& system, const Problem& problem, const std::vector<double>& values, const Section& section,
           bool differentiate, ChosenTerm& chosen, More... more) {
  system.set_parameters(values.data());
  Run session(system, problem.solver, problem.monitor, differentiate ? StartDerivative::columns : StartDerivative::none,
              more...);
  RunWatch watch(problem, values, system);
  watch.begin(problem.solver.t_start, session.y());
  session.watch(watch.sink());
  session.enable_cost();
  if (differentiate) session.enable_sensitivities();
  const double t0 = problem.solver.t_start, t1 = problem.solver.t_end;
  MapRun r;
  r.t = t1;
  double steepness = 0;
  Problem searched = problem;  // what the search for the end sees
  std::optional<EndWatch> end;
  if (section.end()) {
    searched.ends_when = section.end();
    const double after = t0 + std::max(section.settings().after_s, kAtStart * (t1 - t0));
    session.watch([&, seen = watch.sink()](double t, const double* y) {
      if (seen) seen(t, y);
      // A guard is not looked at where its event cannot be: there is nothing to begin with.
      if (t >= after && std::isfinite(section.end()->distance(system.kinematic_state(t, y), system.assembly())))
        throw Passed{t};
    });
    try {
      session.advance(t1);
    } catch (const Passed& passed) {
      searched.solver.t_start = passed.t;
    }
    end.emplace(searched, system);
    end->begin(session.y());
    session.watch(end->sink(watch.sink()));
    try {
      end->advance(session, t1);
    } catch (const NoEndError&) {
      const CycleSettings& s = section.settings();
      throw NoEndError(
          fmt::format("The cycle does not return: {}, its section, does not come again between t = {:.6g} s and "
                      "t_end_s = {:g} s. "
                      "Take a later t_end_s where a cycle may last longer, or a guess, or parameters, from which the "
                      "motion returns.",
                      s.event.empty() ? section.end()->text(system.assembly()) : "'" + s.event + "'", after, t1));
    }
    r.t = end->time();
  } else {
    session.advance(t1);
  }
  watch.finish(r.t, session.y(), end.has_value());
  const double* y = session.y();
  const MechanismState s = solved_state(system, r.t, y);
  Assembly& assembly = system.assembly();
  std::vector<const Output*> read;
  for (const SectionCoordinate& c : section.coordinates()) read.push_back(c.at_end.get());
  if (section.carried().at_end) read.push_back(section.carried().at_end.get());
  const auto d = static_cast<Eigen::Index>(read.size());
  r.positions.assign(s.q, s.q + assembly.n());
  for (const SectionMode& mode : section.modes()) r.modes.push_back(mode.at_end->value(s, assembly));
  r.values.resize(d);
  for (Eigen::Index i = 0; i < d; ++i) r.values[i] = read[static_cast<std::size_t>(i)]->value(s, assembly);
  Eigen::VectorXd kappa = Eigen::VectorXd::Zero(d + 2);
  if (end && differentiate) {
    const bool of_reactions =
        section.end()->output->needs_accelerations() ||
        std::any_of(chosen.psi.begin(), chosen.psi.end(), [](const auto& term) { return term->needs_accelerations(); });
    const Eigen::VectorXd rates = of_reactions ? reaction_rates(problem, s, assembly) : Eigen::VectorXd();
    const std::vector<double> no_change(assembly.numbers().size(), 0.0);
    const Variation motion = along_motion(s, assembly, no_change, rates);
    const double rate = section.end()->output->change(s, assembly, motion);
    steepness = end->steepness(rate);
    if (!(steepness > kGrazed) || problem.solver.rtol / (steepness * steepness) > kNoDerivative)
      throw SolverError(
          fmt::format("The section is grazed: at t = {:.9g} s {} comes with a rate of {:.3g} {}/s, {:.1e} of what it "
                      "ranges over in "
                      "a cycle. The return has no derivative there; take another section.",
                      r.t, section.end()->text(assembly), rate, section.end()->output->unit(), steepness));
    for (Eigen::Index i = 0; i < d; ++i)
      kappa[i] = -read[static_cast<std::size_t>(i)]->change(s, assembly, motion) / rate;
    kappa[d] = -1 / rate;
    double psi_rate = problem.objective.running_value(s, assembly);
    for (const auto& term : chosen.psi) psi_rate += term->change(s, assembly, motion);
    kappa[d + 1] = -psi_rate / rate;
  }
  r.kappa = kappa;
  chosen.chosen = {};
  chosen.chosen.psi = true;
  r.psi = session.cost() + (chosen.psi.empty() ? 0 : system.terminal_cost(r.t, session.y()));
  if (differentiate) {
    const auto np = static_cast<Eigen::Index>(values.size());
    const auto row = [&] {
      const std::vector<double> g = session.sensitivity_gradient();
      return Eigen::RowVectorXd(Eigen::Map<const Eigen::RowVectorXd>(g.data(), np));
    };
    chosen.chosen = {};
    const Eigen::RowVectorXd running = row();  // what psi's integral has of each
    r.rows.resize(d + 2, np);
    for (Eigen::Index i = 0; i < d + 2; ++i) {
      chosen.chosen = {};
      chosen.chosen.output = i < d ? read[static_cast<std::size_t>(i)] : nullptr;
      chosen.chosen.psi = i == d + 1;
      chosen.chosen.kappa = kappa[i];
      r.rows.row(i) = row();
      if (i < d + 1) r.rows.row(i) -= running;
    }
    if (!r.rows.allFinite()) throw SolverError("A derivative of the return is not finite.");
  }
  session.read_forward_counters();
  r.counters = session.counters();
  r.events = session.events();
  if (end)
    r.events.push_back(
        {end->time(), section.settings().event.empty() ? end->event().name : section.end()->output->name()});
  Simulation seen;
  seen.psi = r.psi;
  std::copy_if(r.events.begin(), r.events.end(), std::back_inserter(seen.events),
               [](const RunEvent& e) { return e.cost_unseen > 0; });
  watch.conclude(seen);
  return r;
}

}  // namespace

MapRun run_to_section(const Problem& problem, const std::vector<double>& values, const Section& section,
                      bool differentiate) {
  const std::string integrator = integrator_of(problem);
  if (find_integrator(integrator).discrete)
    throw CapabilityError(
        fmt::format("Cycles are not found on '{}'. Take a formulation on idas or cvodes.", integrator));
  Problem p = problem;
  const auto chosen = std::make_shared<ChosenTerm>();
  chosen->psi = p.objective.terminal;
  if (section.end()) chosen->end = end_term(*section.end(), 1);
  p.objective.terminal = {chosen};
  MapRun r;
  if (integrator == "idas") {
    r = run<IdaRun>(*p.make_dae(), p, values, section, differentiate, *chosen);
  } else {
    r = with_bdf_where_stiff(p, [&](const Problem& on) {
      return run<CvodeRun>(*on.make_ode(), on, values, section, differentiate, *chosen, CvodeSession::Cost::state);
    });
  }
  r.integrator = integrator;
  return r;
}

}  // namespace costate
