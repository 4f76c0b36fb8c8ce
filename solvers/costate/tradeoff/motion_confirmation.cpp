#include "costate/tradeoff/motion_confirmation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/integrator/integrators.h"
#include "costate/problem/known_error.h"
#include "costate/tradeoff/trade_reference.h"

namespace costate {

namespace {

// 1e-6 and 1e-11 themselves, as they are read from a text.
constexpr double kTightestAtOnce = 0.99e-6, kTightestConfirmed = 0.99e-11, kLoosestConfirmed = 0.99e-2;
constexpr double kTighterMotion = 0.1;
// Errors that fall by 2 or more a decade of the tolerance are at most twice the change; a third leaves the rest to
// chance between samples.
constexpr double kPartOfClaim = 1.0 / 3;
// At tighter tolerances a looser run, which takes less than half the steps, tells first whether there is reason to ask:
// what it is off by is some 40 times the run's own error. Nothing is told of what is off by less than kKnown.
constexpr double kLooserMotion = 100, kReason = 1e-3, kKnown = 1e-4;
constexpr int kConfirmingSamples = 100, kSamplesOfFixedSteps = 400;  // brief reversals last some steps
constexpr double kAlwaysOff = 1e4;  // absolute tolerances that an output may always be off by

/// The step that is chosen is for psi, to 0.1 sqrt(rtol): it says less of outputs.
constexpr double kUnknownBySteps = 3e-3;
double reason_of(const Problem& problem) { return has_fixed_steps(integrator_of(problem)) ? kUnknownBySteps : kReason; }
double claim_of(const Problem& problem) {
  if (has_fixed_steps(integrator_of(problem))) return kUnknownBySteps;
  return kPartOfClaim * std::max(kKnown, MotionClaim::of(problem.solver.rtol));
}

struct Change {
  double most = 0;
  TradeMeasure of = TradeMeasure::psi;
  std::string output;
};

/// Of the total energy, against the kinetic one at most or what the total one changes by; 0 where there is none.
double energy_between(const TradeValues& a, const TradeValues& b) {
  if (!a.motion || !b.motion || a.motion->energy.size() != b.motion->energy.size() || b.motion->energy.empty())
    return 0;
  constexpr double kRest = 1e-6;  // what moves by less than that of its energy is at rest
  const auto& of = b.motion->energy;
  double apart = 0, size = *std::max_element(of.begin(), of.end()) - *std::min_element(of.begin(), of.end());
  for (std::size_t i = 0; i < of.size(); ++i) apart = std::max(apart, std::abs(a.motion->energy[i] - of[i]));
  for (const double kinetic : b.motion->kinetic) size = std::max(size, kinetic);
  for (const double total : of) size = std::max(size, kRest * std::abs(total));
  return size > 0 ? apart / size : 0;
}

/// What psi and outputs of `values` are off by against those of `reference`.
Change change_between(const TradeProbe& probe, const TradeValues& values, TradeReference& reference) {
  reference.measure(probe);
  TradeRow row;
  reference.judge(values, probe, row);
  Change r;
  for (const TradeMeasure m : {TradeMeasure::psi, TradeMeasure::outputs})
    if (const auto change = row.error_of(m); change && *change > r.most) {
      r.most = *change;
      r.of = m;
    }
  r.output = row.worst;
  return r;
}

/// Fixed steps that were chosen are halved or doubled: the same tolerance's cousin may have chosen the same.
Problem at_tolerance(const Problem& problem, double factor, const TradeValues& values) {
  Problem r = problem;
  if (has_fixed_steps(integrator_of(problem)) && values.counters.steps > 0) {
    const double step = (problem.solver.t_end - problem.solver.t_start) / static_cast<double>(values.counters.steps);
    r.solver.step_s = factor < 1 ? step / 2 : step * 2;
    return r;
  }
  r.solver.rtol = problem.solver.rtol * factor;
  if (problem.solver.atol > 0) r.solver.atol = problem.solver.atol * factor;
  return r;
}

bool is_acceleration(const std::string& output) { return output.ends_with("_ddot"); }

/// The same at tight tolerances, where outputs of a small range have as many digits as what they are made of has. An
/// acceleration only where the rest changes by no more than `claim`.
Change motion_change(const TradeProbe& probe, const TradeValues& a, const TradeValues& b, double claim) {
  constexpr double kSmall = 1e-2;  // of the terms' amounts
  Change r{energy_between(a, b), TradeMeasure::outputs, "energy.total"}, acceleration;
  if (!a.motion || !b.motion) return r;
  const std::size_t samples = std::min(a.motion->outputs.size(), b.motion->outputs.size());
  for (std::size_t o = 0; o < probe.outputs().size() && samples > 0; ++o) {
    double apart = 0, low = HUGE_VAL, high = -HUGE_VAL;
    for (std::size_t i = 0; i < samples; ++i) {
      const double x = b.motion->outputs[i][o];
      apart = std::max(apart, std::abs(a.motion->outputs[i][o] - x));
      low = std::min(low, x);
      high = std::max(high, x);
    }
    const double amount = o < b.motion->amounts.size() ? b.motion->amounts[o] : 0;
    const double size = std::max({high - low, kSmall * amount, kSmall * std::max(std::abs(low), std::abs(high))});
    const std::string name = probe.outputs()[o]->name();
    Change& most = is_acceleration(name) ? acceleration : r;
    if (apart > kAlwaysOff * probe.problem().solver.absolute() && apart > most.most * size)
      most = {apart / size, TradeMeasure::outputs, name};
  }
  return r.most > claim ? r : acceleration;
}

/// Whether the looser run is so near that nothing more needs to be asked.
bool looser_agrees(const TradeProbe& probe, const Problem& problem, const TradeValues& values) {
  try {
    const Unsaid another;
    const TradeValues loose = probe.run(at_tolerance(problem, kLooserMotion, values), "");
    const double reason = reason_of(problem);
    return motion_change(probe, loose, values, reason).most <= reason;
  } catch (const SolverError&) {
    return false;
  }
}

}  // namespace

double MotionClaim::of(double rtol) { return std::min(kMost, kClaim * rtol); }

bool motion_is_confirmed(const Problem& problem) {
  const double rtol = problem.solver.rtol;
  const bool own_steps = problem.solver.step_s > 0 && has_fixed_steps(integrator_of(problem));
  return rtol >= kTightestConfirmed && rtol < kLoosestConfirmed && !own_steps;
}

std::vector<std::string> confirmed_outputs(const Problem& problem, const std::vector<std::string>& asked) {
  std::vector<std::string> names = problem.mechanism->coordinate_names();
  const std::size_t coordinates = names.size();
  if (problem.solver.rtol < kTightestAtOnce)
    for (std::size_t i = 0; i < coordinates; ++i) names.push_back(names[i] + "_ddot");
  for (const auto& name : asked)
    if (name != "time" && std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  return names;
}

GradientResult confirmed_simulation(const Problem& problem, const std::vector<double>& rho,
                                    const TradeProbe::Recording& to, const std::vector<std::string>& asked) {
  if (!problem.solver.confirm || !motion_is_confirmed(problem))
    return GradientResult(simulate(problem, rho, to.times, to.sink));
  const int samples = has_fixed_steps(integrator_of(problem)) ? kSamplesOfFixedSteps : kConfirmingSamples;
  const TradeProbe probe(problem, rho, confirmed_outputs(problem, asked), samples);
  GradientResult r;
  const TradeValues values = probe.run(problem, "", &r, &to);
  confirm_motion(probe, problem, values, &r);
  return r;
}

void confirm_motion(const TradeProbe& probe, const Problem& problem, const TradeValues& values, Simulation* result) {
  const double rtol = problem.solver.rtol;
  if (rtol < kTightestAtOnce && looser_agrees(probe, problem, values)) return;
  const Problem tighter = at_tolerance(problem, kTighterMotion, values);
  TradeReference better;
  std::optional<std::string> failure;
  try {
    const Unsaid another;
    better.values = probe.run(tighter, "");
  } catch (const SolverError& e) {
    failure = e.what();
  }
  const bool halved = has_fixed_steps(integrator_of(problem));
  const std::string at = halved ? fmt::format("At steps of {:.3g} s, half of", tighter.solver.step_s)
                                : fmt::format("At rtol {:g}, a tenth of", tighter.solver.rtol);
  if (failure)
    return notice(fmt::format(
        "{} this run's, the motion cannot be followed ({}): how much of it is right is not known.", at, *failure));
  if (result) widen_error(*result, values.psi - better.values.psi);
  const bool tight = rtol < kTightestAtOnce;
  const double claim = tight ? claim_of(problem) : kPartOfClaim * MotionClaim::of(rtol);
  const Change change =
      tight ? motion_change(probe, values, better.values, claim) : change_between(probe, values, better);
  if (change.most <= claim) return;
  const std::string from =
      halved ? fmt::format("steps of {:.3g} s to {:.3g} s", 2 * tighter.solver.step_s, tighter.solver.step_s)
             : fmt::format("rtol {:g} to {:g}", rtol, tighter.solver.rtol);
  const auto coordinates = problem.mechanism->coordinate_names();
  const bool of_motion = change.of == TradeMeasure::psi || change.output == "energy.total" ||
                         std::find(coordinates.begin(), coordinates.end(), change.output) != coordinates.end();
  notice(
      fmt::format("The motion makes much of small errors: from {} {} changes by {:.2g} of {}. {} not known better "
                  "than that here; take a smaller {}.",
                  from, change.of == TradeMeasure::psi ? "psi" : "'" + change.output + "'", change.most,
                  change.of == TradeMeasure::psi ? "it" : "its range",
                  of_motion ? "Psi and the motion are" : "Outputs like that are", halved ? "step" : "rtol"));
}

}  // namespace costate
