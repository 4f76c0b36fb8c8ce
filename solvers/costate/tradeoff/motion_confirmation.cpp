#include "costate/tradeoff/motion_confirmation.h"

#include <fmt/format.h>

#include <algorithm>
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
// At tighter tolerances a looser run, which takes less than half the steps, tells first whether there is reason to ask.
// Errors fall by some 5 or more a decade where they follow the tolerance: 10 claims there are less than one here.
constexpr double kLooserMotion = 100, kClaimsOfLooser = 10;

struct Change {
  double most = 0;
  TradeMeasure of = TradeMeasure::psi;
  std::string output;
};

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

Problem at_tolerance(const Problem& problem, double factor) {
  Problem r = problem;
  r.solver.rtol = problem.solver.rtol * factor;
  if (problem.solver.atol > 0) r.solver.atol = problem.solver.atol * factor;
  return r;
}

/// Whether the looser run is so near that nothing more needs to be asked.
bool looser_agrees(const TradeProbe& probe, const Problem& problem, const TradeValues& values) {
  TradeReference own;
  own.values = values;
  try {
    const Unsaid another;
    const TradeValues loose = probe.run(at_tolerance(problem, kLooserMotion), "");
    return change_between(probe, loose, own).most <= kClaimsOfLooser * MotionClaim::of(problem.solver.rtol);
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

void confirm_motion(const TradeProbe& probe, const Problem& problem, const TradeValues& values, Simulation* result) {
  const double rtol = problem.solver.rtol;
  if (rtol < kTightestAtOnce && looser_agrees(probe, problem, values)) return;
  const Problem tighter = at_tolerance(problem, kTighterMotion);
  TradeReference better;
  std::optional<std::string> failure;
  try {
    const Unsaid another;
    better.values = probe.run(tighter, "");
  } catch (const SolverError& e) {
    failure = e.what();
  }
  if (failure)
    return notice(
        fmt::format("At rtol {:g}, a tenth of this run's, the motion cannot be followed ({}): how much of it "
                    "is right is not known.",
                    tighter.solver.rtol, *failure));
  if (result) widen_error(*result, values.psi - better.values.psi);
  const Change change = change_between(probe, values, better);
  if (change.most <= kPartOfClaim * MotionClaim::of(rtol)) return;
  notice(
      fmt::format("The motion makes much of small errors: from rtol {:g} to {:g} {} changes by {:.2g} of {}. Neither "
                  "psi nor the motion is known better than that here; take a smaller rtol.",
                  rtol, tighter.solver.rtol, change.of == TradeMeasure::psi ? "psi" : "'" + change.output + "'",
                  change.most, change.of == TradeMeasure::psi ? "it" : "its range"));
}

}  // namespace costate
