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

// 1e-6 itself, as it is read from a text.
constexpr double kTightestConfirmed = 0.99e-6, kLoosestConfirmed = 0.99e-2;
constexpr double kTighterMotion = 0.1;
// Errors that fall by 2 or more a decade of the tolerance are at most twice the change; a third leaves the rest to
// chance between samples.
constexpr double kPartOfClaim = 1.0 / 3;

}  // namespace

double MotionClaim::of(double rtol) { return std::min(kMost, kClaim * rtol); }

bool motion_is_confirmed(const Problem& problem) {
  const double rtol = problem.solver.rtol;
  const bool own_steps = problem.solver.step_s > 0 && has_fixed_steps(integrator_of(problem));
  return rtol >= kTightestConfirmed && rtol < kLoosestConfirmed && !own_steps;
}

void confirm_motion(const TradeProbe& probe, const Problem& problem, const TradeValues& values, Simulation* result) {
  const double rtol = problem.solver.rtol;
  Problem tighter = problem;
  tighter.solver.rtol = rtol * kTighterMotion;
  if (problem.solver.atol > 0) tighter.solver.atol = problem.solver.atol * kTighterMotion;
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
  better.measure(probe);
  TradeRow row;
  better.judge(values, probe, row);
  double most = 0;
  TradeMeasure worst = TradeMeasure::psi;
  for (const TradeMeasure m : {TradeMeasure::psi, TradeMeasure::outputs})
    if (const auto change = row.error_of(m); change && *change > most) {
      most = *change;
      worst = m;
    }
  if (most <= kPartOfClaim * MotionClaim::of(rtol)) return;
  notice(
      fmt::format("The motion makes much of small errors: from rtol {:g} to {:g} {} changes by {:.2g} of {}. Neither "
                  "psi nor the motion is known better than that here; take a smaller rtol.",
                  rtol, tighter.solver.rtol, worst == TradeMeasure::psi ? "psi" : "'" + row.worst + "'", most,
                  worst == TradeMeasure::psi ? "it" : "its range"));
}

}  // namespace costate
