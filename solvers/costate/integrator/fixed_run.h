// Fixed-step runs: plain, with the exact tangent beside them, or with the exact adjoint behind them. psi is the sum
// that they form, running cost by the trapezoidal rule on the steps plus the terminal cost, and the gradient is that of
// this sum, to rounding and whatever the step; the step only decides how near psi is to the integral.
//
// A step that is not given (SolverOptions::step_s = 0) is chosen so that psi is off by about 0.1 sqrt(rtol) of itself,
// as estimated from runs with 32, 64, ... steps until halving the step divides the change of psi by about four. It is
// chosen at the problem's own parameter values, not at those that psi is asked for: an optimizer sees one and the same
// discretization.
#pragma once

#include <functional>

#include "costate/discrete/discrete_adjoint.h"
#include "costate/discrete/discrete_tangent.h"
#include "costate/discrete/step_archive.h"
#include "costate/formulation/step_plan.h"
#include "costate/integrator/run_watch.h"
#include "costate/problem/problem.h"

namespace costate {

/// The problem's step, or the one chosen for it, as a number of equal steps over the time span.
long fixed_steps(const Problem& problem);
/// The same problem with its step chosen once and for all; unchanged when the step is given already.
Problem with_fixed_step(const Problem& problem);

/// What `run` gives for a number of steps: that of fixed_steps(), and where the problem leaves the choice and a run of
/// half as many shows that the gradient needs more than psi, so many; a notice where even these are too few.
GradientResult settle_gradient(const Problem& problem, const std::function<GradientResult(long steps)>& run);

class FixedRun {
 public:
  /// Started at the parameters rho.
  FixedRun(const Problem& problem, const std::vector<double>& rho, long steps, StartDerivative wanted);

  DiscreteScheme& scheme() { return *scheme_; }
  long steps() const { return steps_; }
  /// Weight of the running cost at step k.
  double weight(long k) const { return (k == 0 || k == steps_ ? 0.5 : 1.0) * scheme_->coefficients().h; }

  /// Runs to the end and returns psi; `at` is called at the start (k = 0) and after each step.
  double forward(const std::function<void(long k)>& at = {});
  /// Runs back over the archive of a finished forward run.
  std::vector<double> backward(StepArchive& archive, DiscreteAdjoint& adjoint);

  Counters counters() const;
  /// What the watch over a finished forward run noticed; refuses what is not finite.
  void conclude(Simulation& result) const;
  void conclude(GradientResult& result) const;

 private:
  const Problem& problem_;
  std::unique_ptr<DiscreteScheme> scheme_;
  long steps_;
  std::unique_ptr<StepPlan> plan_;
  Counters counters_;
  std::unique_ptr<MotionWatch> watch_;
  FormulaJumpWatch formulas_;  // of costs on accelerations, reactions, force states
};

}  // namespace costate
