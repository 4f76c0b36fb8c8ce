// A run by a Runge-Kutta scheme with step control, explicit (discrete/explicit_scheme.h) or Radau IIA
// (discrete/radau_scheme.h), over a trajectory of one or more smooth segments (Jump in formulation/system.h). Steps end
// at kinks, at events and where the plan of steps asks. Between steps states are those of the explicit scheme's dense
// output, or of a step of the implicit one that ends there; accelerations and multipliers at samples are solved for.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "costate/analysis/not_finite.h"
#include "costate/event/bend_watch.h"
#include "costate/formulation/law_joins.h"
#include "costate/formulation/solved_state.h"
#include "costate/formulation/step_plan.h"
#include "costate/integrator/chatter_watch.h"
#include "costate/integrator/explicit_stiffness.h"
#include "costate/integrator/pace_watch.h"
#include "costate/integrator/runge_kutta_kinds.h"
#include "costate/integrator/segment.h"
#include "costate/problem/problem.h"

namespace costate {

template <class Kind>
class RungeKuttaRun {
 public:
  using SystemType = typename Kind::SystemType;
  using Scheme = typename Kind::Scheme;
  using Step = typename Kind::Step;
  using Stages = typename Kind::Stages;
  using Tape = typename Kind::Tape;
  /// options.integrator names the scheme.
  RungeKuttaRun(SystemType& system, const SolverOptions& options, Monitor monitor, StartDerivative wanted);
  ~RungeKuttaRun();

  const Scheme& scheme() const { return step_->scheme(); }
  /// psi is always carried; here so that the run looks like those of SUNDIALS.
  void enable_cost() {}
  void read_forward_counters() {}
  /// To be told of each step from here on.
  void watch(StepSink after_step) { after_step_ = std::move(after_step); }
  /// Before the first step: each one and each jump is written to the tape.
  void record(Tape* tape) {
    tape_ = tape;
    tape->keep_records_of(*step_);
  }
  /// Before the first step: steps end at bends whose places are known. Where most stages of a step are on one side of
  /// one its error estimate tells little of what it does.
  void follow_bends() {
    bend_watch_ =
        std::make_unique<BendWatch>(system_.assembly(), system_.objective(), options_.rtol, options_.absolute(), true);
    // Which it passes, nobody else is to stop at.
    watch_touches(follows_bends() ? LeftBends::of_rates : LeftBends::none);
  }
  /// Before the first step: all forces that bend are passed by steps so short that the derivative of the run is right,
  /// too. Implicit ones need that for the motion itself: their error estimates pass over a bend.
  void resolve_bends() {
    bends_ = bends_of(system_.assembly().mechanism(), system_.assembly().numbers());
    follow_bends();
    resolves_bends_ = bends_ != Bends::none || follows_bends();
  }
  /// Before the first step: where a slip in space is slow, steps are as short as its direction asks, which turns with
  /// 1/|w|: the derivative of the run is right, too. Implicit ones get on where it begins from rest.
  void resolve_slips() {
    resolves_slips_ = system_.may_slip_in_space();
    if (Kind::implicit) system_.carry_slips_from_rest();
  }
  /// Before the first step: those whose error estimate is nothing are no longer than this.
  void bound_idle_steps(double length) { idle_bound_ = length; }
  /// The longest step whose error estimate was nothing, where no other one was as long and they are most of the run, or
  /// 0: a motion at rest, or a uniform one, has steps of any length, and tells nothing of how derivatives go on
  /// meanwhile.
  double idle_step() const {
    return longest_idle_ > longest_judged_ && idle_time_ > 0.5 * (end_time_ - t_start_) ? longest_idle_ : 0;
  }
  /// Told of each step with its stages, and of each jump, before the state goes on.
  struct Follower {
    std::function<void(const Stages& stages)> step;
    std::function<void(const Jump& jump)> jump;
  };
  void follow(Follower follower) { follower_ = std::move(follower); }

  void advance(double t);
  const double* y() const { return y_.data(); }
  /// psi's running part so far.
  double cost() const { return system_.has_running_cost() ? y_.back() : 0; }
  /// dy/drho at the start, where it was wanted; else empty.
  const Eigen::MatrixXd& start_columns() const { return y_rho_; }

  /// Of the unknowns, and of psi behind them.
  const std::vector<double>& absolute_tolerances() const { return atol_; }
  Counters counters() const;
  /// How many steps were cut because they passed over a touch, over which the next ones are bounded.
  long steps_cut_at_touches() const { return touches_->cuts(); }
  const std::vector<RunEvent>& events() const { return events_; }

 private:
  void take_step();
  /// One of length h, or shorter; it ends at `limit` where it would end near or behind it.
  void find_step(double h, double limit);
  /// Whether the error estimate of a step of length h tells nothing of how long it may be.
  bool is_idle(double h, double error) const;
  /// By resolve_slips(), behind end_time_: what an error of velocities is allowed, and the longest step: a part of the
  /// way to the stop at the last step's pace.
  double allowed_by_slip() const;
  double most_by_slip();
  double largest_velocity() const;
  void begin_step();
  /// The state at a time of the step that begins there.
  const double* within_step(double begin, double t);
  /// Those of the step just attempted.
  GapTrace::States states_within() {
    const bool solved =
        (touches_ && touches_->needs_accelerations()) || (follows_bends() && bend_watch_->needs_accelerations());
    return [this, solved](double at) { return look_state(system_, at, within_step(end_time_, at), solved); };
  }
  /// Whether a force may bend within it.
  bool may_bend() {
    return bends_ == Bends::anywhere || touches_->may_touch(end_time_, step_->t_end(), states_within());
  }
  bool follows_bends() const { return bend_watch_ && !bend_watch_->empty(); }
  /// Whether the step just found has passed the place of a bend and is longer than steps across one may be; another one
  /// is then to be found, until `limit`.
  bool passed_bend(double& limit) {
    if (!follows_bends()) return false;
    const auto end = resolves_bends_ ? bend_watch_->passed(end_time_, step_->t_end(), h_, states_within())
                                     : bend_watch_->within(end_time_, step_->t_end(), states_within());
    if (end) limit = *end;
    return end.has_value();
  }
  /// Whether the step just found has left the motion's branch; a shorter one is then to be found.
  bool left_branch();
  /// Whether the step just found has passed over a touch; another one is then to be found, until `limit`. One that
  /// leads into a touch, or out of it, is ended there.
  bool passed_over(double& limit);
  /// The last step once more, from its beginning, so short that it ends where a guard is zero, near t: the state there
  /// is of the scheme's own order, and a step like others for who follows. To this part of its length; 0: to the last
  /// bit, on the far side.
  void end_step_at(double begin, double t, const std::function<double(double, const double*)>& guard, double near = 0);
  /// The same with the pending event's. False where the step that ends there has no solution: the last step is then a
  /// shorter one, and no event pending.
  bool end_step_at_event(double t);
  /// A part of the way instead, and the event that this step has, if any.
  std::optional<double> step_towards(double event);
  /// The first event within the last step.
  std::optional<double> event_within() {
    return system_.find_event(begin_, end_time_, [this](double at) { return within_step(begin_, at); });
  }
  /// Where the step just found ends.
  void stand_at_end() {
    end_time_ = step_->t_end();
    std::copy(step_->end(), step_->end() + step_->size(), end_.begin());
  }
  double ahead(double t) const;
  void cross();
  void begin_segment(double t, const std::vector<double>& y);
  void start(bool derivative);
  void watch_touches(LeftBends leaves) {
    touches_ = std::make_unique<TouchWatch>(system_.assembly(), system_.objective(), options_.rtol, options_.absolute(),
                                            options_.t_end - options_.t_start, leaves);
  }
  std::unique_ptr<Step> make_step(const Scheme& scheme);
  [[noreturn]] void fail(const std::string& what, const char* flag);

  SystemType& system_;
  SolverOptions options_;
  Monitor monitor_;
  std::unique_ptr<Step> step_;
  std::unique_ptr<StepPlan> plan_;
  std::unique_ptr<TouchWatch> touches_;
  std::unique_ptr<BendWatch> bend_watch_;
  TouchLook look_;  // a touch that a step has passed over
  Tape* tape_ = nullptr;
  Follower follower_;
  StepSink after_step_;
  Eigen::MatrixXd y_rho_;
  std::vector<double> y_, atol_, end_;
  double t_start_, segment_start_, begin_, end_time_;  // the last step; end_ is the state where it ends
  double h_ = 0;                                       // the next step's length
  double longest_ = HUGE_VAL;                          // that a step may be
  double idle_bound_ = HUGE_VAL;                       // of those whose error estimate is nothing
  double idle_time_ = 0, longest_idle_ = 0, longest_judged_ = 0;
  bool bend_behind_ = false;                                             // that step was one across a bend
  bool pending_step_ = false;                                            // step_ holds a step that has been taken
  bool ended_ = false;                                                   // the segment
  bool resolves_bends_ = false;                                          // for derivatives
  bool resolves_slips_ = false;                                          // in space
  double slip_ = std::numeric_limits<double>::infinity(), slip_at_ = 0;  // the slowest |w|, and when
  Bends bends_ = Bends::none;                                            // those that are resolved
  std::string last_step_error_;
  std::optional<NotFinite> not_finite_;
  PaceWatch pace_;
  ExplicitStiffness stiffness_;
  long steps_ = 0, rejected_ = 0, failed_ = 0, jumps_ = 0, polled_ = 0;
  std::size_t jumps_in_a_row_ = 0;
  ChatterWatch chatter_;
  std::vector<RunEvent> events_;
};

using ExplicitRun = RungeKuttaRun<ExplicitKind>;
using RadauRun = RungeKuttaRun<RadauKind>;
extern template class RungeKuttaRun<ExplicitKind>;
extern template class RungeKuttaRun<RadauKind>;

}  // namespace costate
