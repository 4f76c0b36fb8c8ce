// Fixed-step runs: plain, with the exact tangent beside them, or with the exact adjoint behind them. psi is the sum
// that they form, running cost by the trapezoidal rule on the steps plus the terminal cost, and the gradient is that of
// this sum, to rounding and whatever the step; the step only decides how near psi is to the integral.
//
// Steps end at the times of a grid, but where the run is cut (discrete/step_cut.h): at events, at kinks of drivers and
// at jumps of laws, whether parameters move them or not, and where ends_when ends it. One step leads from there to the
// grid's next time, and the others keep their length. What is nearer than a tiny part of a step to one of the grid's
// times is met by the step to, or from, that time in its place.
//
// A step that is not given (SolverOptions::step_s = 0) is chosen so that psi is off by about 0.1 sqrt(rtol) of itself,
// as estimated from runs with 32, 64, ... steps until halving the step divides the change of psi by about four. It is
// chosen at the problem's own parameter values, not at those that psi is asked for: an optimizer sees one and the same
// discretization.
#pragma once

#include <functional>
#include <optional>

#include "costate/analysis/own_jump_watch.h"
#include "costate/discrete/step_archive.h"
#include "costate/discrete/step_cut.h"
#include "costate/discrete/step_interpolant.h"
#include "costate/event/grazing_watch.h"
#include "costate/event/idle_contact_watch.h"
#include "costate/event/slip_offset_watch.h"
#include "costate/formulation/step_plan.h"
#include "costate/integrator/fixed_touches.h"
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
  /// Of the grid; a run that is cut takes more or fewer.
  long steps() const { return steps_; }
  /// Some more than the run will take, as long as it is not cut often.
  long expected_steps() const { return cuts_possible_ ? steps_ + steps_ / 8 + 64 : steps_; }

  /// Who goes along with a run, at the scheme's present record each time.
  struct Follower {
    /// At the start (k = 0) and behind each step; `begun`: the cut at which the step began, or null.
    std::function<void(long k, const StepCut* begun)> step = {};
    /// The step has been cut, and the state is that before it; then that behind it, where the scheme has begun anew.
    std::function<void(const StepCut&cut)> cut = {}, behind = {};
    /// The running cost is evaluated here; then the weight that it has at the last such state.
    std::function<void()> node = {};
    std::function<void(double weight)> weigh = {};
  };
  /// Runs to the end and returns psi.
  double forward(const Follower& follower);
  /// `at` is called at the start (k = 0) and after each step.
  double forward(const std::function<void(long k)>& at = {});
  /// Runs back over the archive of a finished forward run.
  std::vector<double> backward(StepArchive& archive, DiscreteAdjoint& adjoint);

  /// Complete after forward(), in order of time.
  const std::vector<StepCut>& cuts() const { return cuts_; }
  const std::vector<RunEvent>& events() const { return events_; }
  /// What has ended the run before its last time.
  const std::optional<RunEvent>& end() const { return end_; }
  bool finished() const { return finished_; }

  /// Steps are those of the grid over the whole time span, whose length is the step's.
  Counters counters() const;
  /// What the watch over a finished forward run noticed; refuses what is not finite.
  void conclude(Simulation& result) const;
  void conclude(GradientResult& result) const;

 private:
  // In fixed_cuts.cpp.
  void find_places();
  /// The step from the present record, or the instant, to the grid's next time or to a cut, which is then in found_.
  void take_step();
  /// Within the step just taken, which was to lead to `stop`, up to `until`.
  void look_for_event(double until);
  void look_for_end(double until);
  /// The motion at a time of the step just taken.
  const double* course_at(double t);
  /// The state there, with accelerations where they are asked for.
  StateView within(double t, bool solved);
  /// The step just taken once more, so long that `value` at its own end is zero; that is near t.
  void end_step_at(double t, const std::string& what, bool far_side,
                   const std::function<double(const StateView&)>& value, bool solved);
  /// Cuts the step for `cut` near t, by an instant where it has just begun.
  void cut_step(StepCut cut, double t, const std::function<double(const StateView&)>& value, bool solved);
  /// found_, which the step has been cut for, with its derivatives and, but at the end, what is behind it.
  void complete_cut();
  void require_new_time(double length);
  void condition_of_end();
  /// Of a run that an event was to end: that it has, and how.
  void conclude_end();
  /// How fast the terms change by explicit time alone, at the present record.
  double time_change(const std::vector<std::shared_ptr<const CostTerm>>& terms);

  double grid_time(long k) const { return scheme_->start_time() + static_cast<double>(k) * scheme_->regular_length(); }
  bool differentiates() const { return wanted_ != StartDerivative::none; }
  void begin(const Follower& follower);
  void accept(const Follower& follower);
  void look(const StateView& here);
  /// What is watched beside the motion itself.
  void look_besides(const StateView& s);
  void node(const Follower& follower);
  void weigh(const Follower& follower, double weight);
  double cross_back(const StepCut& cut, double by_beginning, DiscreteAdjoint& adjoint);

  const Problem& problem_;
  StartDerivative wanted_;
  std::unique_ptr<DiscreteScheme> scheme_;
  long steps_;
  std::unique_ptr<StepPlan> plan_;
  Counters counters_;
  std::unique_ptr<MotionWatch> watch_;
  GrazingWatch grazing_;
  SlipOffsetWatch offsets_;
  IdleContactWatch idle_;
  FormulaJumpWatch formulas_;  // of costs on accelerations, reactions, force states
  OwnJumpWatch own_jumps_;
  std::unique_ptr<FixedTouches> touches_;

  bool cuts_possible_ = false, running_ = false, finished_ = false;
  std::vector<double> places_;  // of laws, at which the run is cut, in order
  double beside_ = 0;           // before and behind them laws are evaluated on either side
  std::vector<MovingInstant> moving_;
  double psi_ = 0;
  long last_ = 0;      // step of a finished run
  long grid_ = 0;      // of the present record: the last time of the grid that has been passed
  double looked_ = 0;  // events and the end are looked for from here on
  double last_length_ = 0;
  double cost_ = 0, cost_at_beginning_ = 0;  // the running cost at the present record, and at the step's beginning
  double cost_by_time_ = 0;                  // behind the last cut, by explicit time alone
  std::size_t jumps_in_a_row_ = 0;
  std::optional<StepCut> found_;
  double place_ = 0;  // at which that is, of a kink
  std::vector<StepCut> cuts_;
  bool begins_at_cut_ = false;  // the next step, at the last one of these
  std::unique_ptr<StepInterpolant> course_;
  std::unique_ptr<StepLength> length_;
  std::unique_ptr<CutCrossing> crossing_;
  std::unique_ptr<EndSearch> end_search_;
  std::vector<RunEvent> events_;
  std::optional<RunEvent> end_;
  std::vector<double> kinks_;  // of drivers
  std::vector<double> straight_;
};

}  // namespace costate
