#include "costate/tradeoff/motion_confirmation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/integrator/bent_motion.h"
#include "costate/integrator/integrators.h"
#include "costate/integrator/run_watch.h"
#include "costate/problem/known_error.h"
#include "costate/problem/redundant_rows.h"
#include "costate/sensitivity/confirmation.h"
#include "costate/sensitivity/error_estimate.h"
#include "costate/sensitivity/soft_end.h"
#include "costate/tradeoff/trade_reference.h"

namespace costate {

namespace {

// 1e-6 and 1e-11 themselves, as they are read from a text.
constexpr double kTightestAtOnce = 0.99e-6, kTightestConfirmed = 0.99e-11, kLoosestConfirmed = 0.99e-2;
constexpr double kTighterMotion = 0.1;
// Errors that fall by 2 or more a decade of the tolerance are at most twice the change; a third leaves the rest to
// chance between samples.
constexpr double kPartOfClaim = 1.0 / 3;
// Nothing is told of what is off by less than kKnown. At tighter tolerances a looser run, which takes less than half
// the steps, tells first whether there is reason to ask: what it is off by is mostly some 40 times the run's own error.
constexpr double kLooserMotion = 100, kOfLooser = 0.1, kKnown = 1e-4;
// Where forces bend, something touches or events happen errors fall by fits and starts, as those of gradients do: of
// 120 runs of a wheel that hops over a table's road nine were off by 2 to 8 times a tenth of that change.
constexpr double kOfLooserOverBends = 1.0 / 3, kOfTighterOverBends = 2;
// Errors of methods of many steps are some 20 to 400 tolerances. Where psi changes by less than this of the looser one,
// the two are near each other by chance as a rule (one that was off by 1,200 rtol was told as 5 of them).
constexpr double kHardlyByChance = 1;
// No estimate is below this part of the tolerance: two runs may have the same steps, and the same errors.
constexpr double kLeastOfTolerance = 0.01;
constexpr int kConfirmingSamples = 100, kSamplesOfFixedSteps = 400;  // brief reversals last some steps
constexpr double kTurn = 2 * std::numbers::pi;
// Of an output's range: a motion that changes by so much is another one.
constexpr double kLostMotion = 0.1;
constexpr double kAlwaysOff = 1e4;  // absolute tolerances that an output may always be off by

/// The step that is chosen is for psi, to 0.1 sqrt(rtol): it says less of outputs.
constexpr double kUnknownBySteps = 3e-3;
double reason_of(const Problem& problem) {
  const Integrator& integrator = find_integrator(integrator_of(problem));
  if (has_fixed_steps(integrator.name)) return kUnknownBySteps;
  // A scheme of one step and high order: its error may hardly follow the tolerance where a force is no such polynomial.
  return integrator.discrete ? kPartOfClaim * kKnown : kKnown;
}
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
  r.solver.set_rtol(problem.solver.rtol * factor);
  return r;
}

bool is_acceleration(const std::string& output) { return output.ends_with("_ddot"); }

/// What reactions and outputs of them and of accelerations range over, by unit: each is a sum of terms of the others'
/// size, of whose errors it has its part.
std::map<std::string, double> sizes_of_reactions(const TradeProbe& probe, const TradeMotion& motion) {
  std::map<std::string, double> sizes;
  for (std::size_t o = 0; o < probe.outputs().size(); ++o) {
    const Output& output = *probe.outputs()[o];
    if (!output.needs_accelerations() || is_acceleration(output.name())) continue;
    double& size = sizes[output.unit()];
    for (const auto& sample : motion.outputs) size = std::max(size, std::abs(sample[o]));
  }
  return sizes;
}

/// The same at tight tolerances, where outputs of a small range have as many digits as what they are made of has. What
/// is told first: the motion, then what else is handed out, then accelerations.
Change motion_change(const TradeProbe& probe, const TradeValues& a, const TradeValues& b, double claim) {
  constexpr double kSmall = 1e-2;    // of the terms' amounts
  constexpr double kOfOthers = 1e2;  // tolerances of the largest of the kind
  Change motion{energy_between(a, b), TradeMeasure::outputs, "energy.total"}, output, acceleration;
  if (!a.motion || !b.motion) return motion;
  const std::size_t samples = std::min(a.motion->outputs.size(), b.motion->outputs.size());
  const std::size_t coordinates = probe.problem().mechanism->coordinate_names().size();
  const std::map<std::string, double> kinds = sizes_of_reactions(probe, *b.motion);
  const SolverOptions& solver = probe.problem().solver;
  for (std::size_t o = 0; o < probe.outputs().size() && samples > 0; ++o) {
    const Output& of = *probe.outputs()[o];
    double apart = 0, low = HUGE_VAL, high = -HUGE_VAL;
    for (std::size_t i = 0; i < samples; ++i) {
      const double x = b.motion->outputs[i][o];
      // Angles of a body's position start again at half a turn.
      const double change = a.motion->outputs[i][o] - x;
      const bool turns = o >= coordinates && of.unit() == "rad";
      apart = std::max(apart, std::abs(turns ? std::remainder(change, kTurn) : change));
      low = std::min(low, x);
      high = std::max(high, x);
    }
    const double amount = o < b.motion->amounts.size() ? b.motion->amounts[o] : 0;
    const double size = std::max({high - low, kSmall * amount, kSmall * std::max(std::abs(low), std::abs(high))});
    double always = kAlwaysOff * solver.absolute();
    if (of.needs_accelerations() && !is_acceleration(of.name()))
      always = std::max(always, kOfOthers * solver.rtol * kinds.at(of.unit()));
    Change& most = o < coordinates ? motion : is_acceleration(of.name()) ? acceleration : output;
    if (apart > always && apart > most.most * size) most = {apart / size, TradeMeasure::outputs, of.name()};
  }
  return motion.most > claim ? motion : output.most > claim ? output : acceleration;
}

/// Where psi is so near that of the looser run that it tells nothing of its error, a tighter run's does.
void look_beyond_chance(const Problem& problem, const std::vector<double>& rho, const TradeValues& values,
                        double of_loose, Simulation& result) {
  const double change = std::abs(values.psi - of_loose);
  if (find_integrator(integrator_of(problem)).discrete || problem.solver.rtol < kTightestConfirmed || change == 0 ||
      !(change < kHardlyByChance * kLooserMotion * problem.solver.rtol * std::abs(values.psi)))
    return;
  Problem tighter = at_tolerance(problem, kTighterMotion, values);
  tighter.solver.confirm = false;
  try {
    widen_error(result, values.psi - simulate(tighter, rho).psi);
  } catch (const SolverError&) {
    // Nothing more is known.
  }
}

/// What a looser run is off by; null where it fails. psi's error is about a tenth of what that one's is, as for
/// gradients.
std::optional<Change> off_by_looser(const TradeProbe& probe, const Problem& problem, const TradeValues& values,
                                    Simulation* result) {
  try {
    const Unsaid another;
    const TradeValues loose = probe.run(at_tolerance(problem, kLooserMotion, values), "");
    const Change change = motion_change(probe, loose, values, reason_of(problem));
    if (result && change.most <= reason_of(problem)) {
      widen_error(*result,
                  (falls_by_fits(problem, *result) ? kOfLooserOverBends : kOfLooser) * (values.psi - loose.psi));
      look_beyond_chance(problem, probe.rho(), values, loose.psi, *result);
      widen_error(*result, kLeastOfTolerance * problem.solver.rtol * std::abs(values.psi));
    }
    return change;
  } catch (const SolverError&) {
    return std::nullopt;
  }
}

/// A psi far below what absolute tolerances are made for has their errors at any rtol: a run with smaller ones tells. A
/// whole motion below them is damped away by all that are loose.
void widen_by_small_psi(const Problem& problem, const std::vector<double>& rho, Simulation& result) {
  Problem finer = problem;
  const double psi = std::abs(result.psi);
  if (problem.solver.rtol >= kTightestAtOnce) {
    if (has_fixed_steps(integrator_of(problem)) || !resolve_any_psi(finer, psi)) return;
    finer.solver.set_rtol(kTighterMotion * problem.solver.rtol);
  } else if (problem.objective.running.empty() || !resolve_small_psi(finer, psi)) {
    return;
  }
  try {
    const Unsaid another;
    finer.solver.confirm = false;
    widen_error(result, result.psi - simulate(finer, rho).psi);
  } catch (const SolverError&) {
    // Nothing more is known.
  }
}

/// Two runs of a motion that has nothing to do with another one may have psi in common by chance.
void tell(const Problem& problem, const Change& change, const std::string& from, const std::string& advice,
          Simulation* result) {
  const auto coordinates = problem.mechanism->coordinate_names();
  const bool of_motion = change.of == TradeMeasure::psi || change.output == "energy.total" ||
                         std::find(coordinates.begin(), coordinates.end(), change.output) != coordinates.end();
  if (of_motion && result && change.most > kLostMotion)
    widen_error(*result, std::min(1.0, change.most) * std::abs(result->psi));
  notice(
      fmt::format("The motion makes much of small errors: from {} {} changes by {:.2g} of {}. {} not known better "
                  "than that here; {}.",
                  from, change.of == TradeMeasure::psi ? "psi" : "'" + change.output + "'", change.most,
                  change.of == TradeMeasure::psi ? "it" : "its range",
                  of_motion ? "Psi and the motion are" : "Outputs like that are", advice));
}

}  // namespace

double MotionClaim::of(double rtol) { return std::min(kMost, kClaim * rtol); }

bool motion_is_confirmed(const Problem& problem) {
  const double rtol = problem.solver.rtol;
  const bool own_steps = problem.solver.step_s > 0 && has_fixed_steps(integrator_of(problem));
  return rtol < kLoosestConfirmed && !own_steps;
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

std::vector<std::string> all_that_is_told(const Problem& problem, const std::vector<double>& rho,
                                          const std::vector<std::string>& outputs) {
  if (!problem.solver.confirm || !motion_is_confirmed(problem)) return outputs;
  const std::vector<std::string> all = determined_outputs(problem, rho);
  return all.empty() ? outputs : all;
}

GradientResult confirmed_simulation(const Problem& problem, const std::vector<double>& rho,
                                    const TradeProbe::Recording& to, const std::vector<std::string>& asked) {
  if (problem.cycle && !(problem.objective.running.empty() && problem.objective.terminal.empty()))
    notice(
        "This run begins where the scene does, and so is psi: gradients and optimizations take psi over the limit "
        "cycle ([run] cycle = true), which 'costate cycle' finds.");
  if (!problem.solver.confirm || !motion_is_confirmed(problem))
    return GradientResult(simulate(problem, rho, to.times, to.sink));
  const int samples = has_fixed_steps(integrator_of(problem)) ? kSamplesOfFixedSteps : kConfirmingSamples;
  const TradeProbe probe(problem, rho, confirmed_outputs(problem, asked), samples);
  GradientResult r;
  const TradeValues values = probe.run(problem, "", &r, &to);
  const double drift = last_drift();
  confirm_motion(probe, problem, values, &r);
  widen_by_softness(problem, rho, drift, r);
  watch_soft_end(problem, rho, r);
  widen_by_small_psi(problem, rho, r);
  return r;
}

void confirm_motion(const TradeProbe& probe, const Problem& problem, const TradeValues& values, Simulation* result) {
  const double rtol = problem.solver.rtol;
  if (rtol < kTightestAtOnce) {
    const std::optional<Change> off = off_by_looser(probe, problem, values, result);
    if (off && off->most <= reason_of(problem)) return;
    if (rtol < kTightestConfirmed) {  // a tighter one is rounding
      if (off)
        tell(problem, *off, fmt::format("rtol {:g} to {:g}", kLooserMotion * rtol, rtol),
             "a shorter time may be, or another start", result);
      return;
    }
  }
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
  if (failure && result && result->known_error) result->known_error->all = false;
  if (failure)
    return notice(fmt::format(
        "{} this run's, the motion cannot be followed ({}): how much of it is right is not known.", at, *failure));
  if (result)
    widen_error(*result, std::max((falls_by_fits(problem, *result) ? kOfTighterOverBends : 1) *
                                      std::abs(values.psi - better.values.psi),
                                  kLeastOfTolerance * rtol * std::abs(values.psi)));
  const bool tight = rtol < kTightestAtOnce;
  const double claim = tight ? claim_of(problem) : kPartOfClaim * MotionClaim::of(rtol);
  const Change change =
      tight ? motion_change(probe, values, better.values, claim) : change_between(probe, values, better);
  if (change.most <= claim) return;
  const std::string from =
      halved ? fmt::format("steps of {:.3g} s to {:.3g} s", 2 * tighter.solver.step_s, tighter.solver.step_s)
             : fmt::format("rtol {:g} to {:g}", rtol, tighter.solver.rtol);
  tell(problem, change, from, halved ? "take a smaller step" : "take a smaller rtol", result);
}

}  // namespace costate
