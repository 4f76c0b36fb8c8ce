#include "cycle_accuracy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "accuracy.h"
#include "costate/base/notice.h"
#include "costate/cycle/cycle_errors.h"
#include "costate/problem/redundant_rows.h"
#include "costate/tradeoff/pilot_race.h"

namespace costate::app {

namespace {

// The first tolerance against the accuracy, and where the search for one ends. The cycle's own searches go on
// to three hundredths.
constexpr double kFirstTolerance = 0.1, kLoosestTolerance = 1e-4, kTightestTolerance = 1e-12;
// A tolerance is not chosen to just meet a request.
constexpr double kAimedAt = 0.4;

/// The largest error and what it is of, derivatives included where there are any.
std::pair<double, std::string> worst_of(const CycleResult& r, const ParameterSelection& parameters, bool costs,
                                        bool travels) {
  std::pair<double, std::string> worst = {0, "period"};
  const auto count = [&](double error, double size, const std::string& of) {
    if (size == 0) return;
    const double relative = error / size;
    if (!(relative <= worst.first)) worst = {std::isfinite(relative) ? relative : HUGE_VAL, of};
  };
  count(r.period.error, std::abs(r.period.value), "period");
  if (travels) count(r.travel.error, std::abs(r.travel.value), "travel");
  if (costs) count(r.psi.error, std::abs(r.psi.value), "psi");
  const Eigen::VectorXd sizes = comparable_sizes(r.units, r.period.value, r.x);
  for (std::size_t i = 0; i < r.names.size(); ++i)
    count(r.x_error[static_cast<Eigen::Index>(i)], sizes[static_cast<Eigen::Index>(i)], r.names[i]);
  if (!r.multipliers.empty()) count(r.multiplier_error, std::max(1.0, r.largest()), "multiplier");
  if (r.x_rho_error.size() == 0) return worst;
  const auto scaled = [&](const Eigen::VectorXd& by) { return scaled_size(by, parameters); };
  count(scaled(r.period_rho_error), scaled(r.period_rho), "period's derivatives");
  if (travels) count(scaled(r.travel_rho_error), scaled(r.travel_rho), "travel's derivatives");
  if (costs) count(scaled(r.psi_rho_error), scaled(r.psi_rho), "gradient");
  count(relative_error(r.units, r.period.value, r.x_rho, r.x_rho_error, parameters), 1, "fixed point's derivatives");
  return worst;
}

/// Short runs from the scene's start; cycles are found on the integrators of SUNDIALS.
std::vector<AccuracyPilot> choose(Setup& setup, const CommonOptions& common, double accuracy) {
  PilotRace race(setup.problem, setup.rho, !redundant_joints(setup.problem, setup.rho).empty(),
                 [&](const Formulation& f, const Integrator& i) {
                   return !i.discrete && (common.formulation.empty() || f.name == setup.problem.formulation) &&
                          (common.integrator.empty() || i.name == setup.problem.solver.integrator);
                 },
                 {});
  const std::vector<AccuracyPilot> ended = race.run(std::min(kFirstTolerance * accuracy, kLoosestTolerance));
  setup.problem.formulation = ended.front().what.formulation;
  setup.problem.solver.integrator = ended.front().what.integrator;
  return race.pilots();
}

}  // namespace

AccurateCycle find_accurate_cycle(Setup& setup, const CommonOptions& common, double accuracy, CycleOptions options) {
  const std::vector<AccuracyPilot> pilots = choose(setup, common, accuracy);
  SolverOptions& solver = setup.problem.solver;
  const Objective& cost = setup.problem.objective;
  // Derivatives are of the last searches alone.
  const CycleOptions asked = options;
  const bool derivatives = asked.derivatives && setup.problem.parameters.size() > 0;
  options.estimate = true;
  options.derivatives = options.multiplier = false;
  AccurateCycle a;
  double rtol = std::min(kFirstTolerance * accuracy, kLoosestTolerance);
  for (int runs = 1;; ++runs) {
    solver.set_rtol(rtol);
    bool found = true;
    try {
      a.result = find_cycle(setup.problem, *setup.scene.cycle, setup.rho, options);
    } catch (const SolverError&) {
      if (rtol <= kTightestTolerance) throw;
      found = false;  // a tolerance too loose for this cycle
    }
    if (found) {
      std::tie(a.relative, a.worst) =
          worst_of(a.result, setup.problem.parameters, !cost.running.empty() || !cost.terminal.empty(),
                   !setup.scene.cycle->travel.empty());
      a.met = a.relative <= accuracy;
      if (a.met || rtol <= kTightestTolerance) {
        if (derivatives && !options.derivatives) {
          options.derivatives = true;
          options.multiplier = asked.multiplier;
          continue;
        }
        a.json = {{"asked", accuracy}, {"met", a.met}, {"estimated", a.relative},      {"worst", a.worst},
                  {"rtol", rtol},      {"runs", runs}, {"pilots", pilots_json(pilots)}};
        break;
      }
    }
    const double next = found ? rtol * std::clamp(kAimedAt * accuracy / a.relative, 1e-3, 0.2) : 0.1 * rtol;
    rtol = std::max(next, kTightestTolerance);
  }
  if (!a.met)
    notice(
        fmt::format("The accuracy {:.1g} was not reached: at rtol {:.1e} the error of the {} is estimated as {:.1e}.",
                    accuracy, solver.rtol, a.worst, a.relative));
  return a;
}

}  // namespace costate::app
