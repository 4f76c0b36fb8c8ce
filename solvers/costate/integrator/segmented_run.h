// A run over a trajectory of one or more smooth segments (Jump in formulation/system.h): one session a segment, the
// state and its sensitivities carried across the jumps, the adjoint carried back. For systems without jumps it is its
// only session and nothing else. Outside it looks like a session. Of an adjoint run as many segments keep their steps
// as fit into the memory budget of the whole; older ones keep where they began, and are run again on the way back.
#pragma once

#include <algorithm>
#include <memory>

#include "costate/adjoint/motion_jump.h"
#include "costate/formulation/smooth_motion.h"
#include "costate/integrator/adjoint_invariant.h"
#include "costate/integrator/chatter_watch.h"
#include "costate/integrator/cvode_session.h"
#include "costate/integrator/ida_session.h"
#include "costate/integrator/slow_stretches.h"

namespace costate {

template <class Session, class SystemType>
class SegmentedRun {
 public:
  /// `more`: what the session's constructors take behind the start.
  template <class... More>
  SegmentedRun(SystemType& system, const SolverOptions& options, const Monitor& monitor, StartDerivative wanted,
               More... more)
      : system_(system), options_(options), monitor_(monitor) {
    sessions_.push_back(std::make_unique<Session>(system, options, monitor, wanted, more...));
    t_start_ = options.t_start;
    system.end_unresolved_slips(options.rtol, options.absolute());
    system.begin_events(t_start_, session().y());
    session().meet_hop(system.event_hop());
    touches_ = std::make_unique<TouchWatch>(system.assembly(), system.objective(), options.rtol, options.absolute(),
                                            options.t_end - options.t_start);
    follow(std::make_shared<const StepPlan>(system, system.objective(), options.t_start, options.t_end, session().y()));
    make_session_ = [&system, options, monitor, more...](const SegmentStart& start) {
      return std::make_unique<Session>(system, options, monitor, start, more...);
    };
  }

  /// Another plan for the steps than that of the system and its cost.
  void follow(std::shared_ptr<const StepPlan> plan) {
    plan_of_steps_ = std::move(plan);
    session().follow(plan_of_steps_);
    session().follow(touches_.get());
    smooth_ = is_smooth(system_, *touches_, *plan_of_steps_, options_.t_end, options_.rtol, options_.absolute());
    if (smooth_) session().follow_smooth_motion();
    segmented_ = system_.may_jump() || !plan_of_steps_->empty() || !touches_->empty();
  }
  /// For runs back along the motion so far: whatever has touched is met on the way back as well.
  std::shared_ptr<const StepPlan> plan_back() const {
    return std::make_shared<const StepPlan>(plan_of_steps_->with_looks(touches_->touches(options_.t_end)));
  }

  void enable_cost() {
    cost_ = true;
    session().enable_cost();
  }
  void enable_sensitivities() {
    sensitivities_ = true;
    session().enable_sensitivities();
  }
  /// Once the costs are enabled; the plan is that of each segment.
  void enable_adjoint(const CheckpointPlan& plan) {
    adjoint_ = true;
    plan_ = plan;
    most_kept_ = segments_that_fit(options_, system_.size(), plan);
    start_y_.assign(session().y(), session().y() + system_.size());
    touches_->record_bends({system_.assembly(), system_.objective(), options_.rtol, options_.absolute()});
    session().follow(touches_.get());
    segmented_ = segmented_ || !touches_->empty();
    session().enable_adjoint(plan);
    follow_slow_slips();
  }
  /// Of runs whose tangents or adjoints are not integrated with the motion; before the first step.
  void follow_slow_slips() {
    if (!system_.may_slip_in_space()) return;
    system_.carry_slips_from_rest();
    slow_ = std::make_unique<SlowStretches>(system_, options_.rtol, options_.absolute());
    slow_->begin(0, t_start_, session().y(), session().yp());
  }
  /// Once the run has come to its end at t: the stretches that it has found (or null).
  SlowStretches* slow_slips(double t) {
    if (slow_) slow_->end(t, session().y());
    return slow_.get();
  }

  /// To be told of each step from here on; the run then goes by single steps.
  void watch(StepSink after_step) { after_step_ = std::move(after_step); }

  void advance(double t) { segmented_ || after_step_ ? advance_segments(t) : session().advance(t); }
  void advance_with_checkpoints(double t) {
    advance(t);
    t_ = t;
  }

  /// The same, and stores the motion (q, v, z).
  void advance_recording(double t, Trajectory& trajectory) { advance_segments(t, &trajectory); }

  /// Of an adjoint run: psi has a term of the state that the run has come to, number `index` of the caller's.
  void keep_sample(std::size_t index) {
    Sample s{index, t_, sessions_.size() - 1, {}, {}};
    s.y.assign(session().y(), session().y() + system_.size());
    if (const double* yp = session().yp()) s.yp.assign(yp, yp + system_.size());
    if (slow_) slow_->part(t_, session().y(), session().yp());
    samples_.push_back(std::move(s));
  }

  const double* y() { return session().y(); }
  double cost() { return session().cost(); }
  std::vector<double> sensitivity_gradient() { return session().sensitivity_gradient(); }
  std::vector<double> terminal_gradient() { return session().terminal_gradient(); }

  /// Forward counters; to be called before solve_adjoint().
  void read_forward_counters() {
    for (auto& s : sessions_)
      if (s) s->read_forward_counters();
    note_length(session().counters());
  }
  /// Of an adjoint run, thereafter: the most steps of one segment, and whether one took more than the plan keeps.
  long longest_segment() const { return longest_; }
  bool outgrew_plan() const { return outgrown_; }
  /// `add`: what a kept sample, of its index, adds to the adjoint and the gradient there.
  using SampleAdjoint =
      std::function<void(std::size_t index, double t, const std::vector<double>& y, const std::vector<double>& yp,
                         AdjointState& mu, std::vector<double>& gradient)>;
  std::vector<double> solve_adjoint(const SampleAdjoint& add = {});
  /// After that: where an error of the size of the tolerance changes psi most.
  AdjointGrowth adjoint_growth() const {
    AdjointGrowth most = growth_;
    for (const auto& s : sessions_)
      if (s && !(s->adjoint_growth().change() <= most.change())) most = s->adjoint_growth();
    return most;
  }
  /// After that: what the adjoint should have kept.
  const AdjointInvariant& invariant() const { return invariant_; }
  Counters counters() const;
  /// The events met so far.
  const std::vector<RunEvent>& events() const { return events_; }
  /// Of a motion that is stored the same with the states before them.
  const std::vector<MetEvent>& met_events() const { return met_; }

 private:
  Session& session() { return *sessions_.back(); }
  void advance_segments(double t, Trajectory* trajectory = nullptr);
  void keep_met(const Jump& jump);
  /// The adjoint across a slow stretch.
  void cross_slowly(std::size_t stretch, AdjointState& mu, std::vector<double>& gradient);
  void begin_segment(const SegmentStart& start, std::unique_ptr<Session>& session);
  void note_length(const Counters& segment) {
    longest_ = std::max(longest_, segment.steps);
    outgrown_ = outgrown_ || segment.checkpoints > 0;
  }
  /// The oldest segments give up their steps, but for the first one, until the others fit.
  void drop_segments();

  SystemType& system_;
  SolverOptions options_;
  Monitor monitor_;
  bool segmented_ = false, smooth_ = false, cost_ = false, sensitivities_ = false, adjoint_ = false;
  double t_start_ = 0, t_ = 0;
  CheckpointPlan plan_;
  std::shared_ptr<const StepPlan> plan_of_steps_;
  std::unique_ptr<TouchWatch> touches_;
  std::unique_ptr<SlowStretches> slow_;  // or null
  StepSink after_step_;
  std::vector<double> start_y_;
  AdjointInvariant invariant_;
  std::function<std::unique_ptr<Session>(const SegmentStart&)> make_session_;
  std::vector<std::unique_ptr<Session>> sessions_;  // of an adjoint run all, null where dropped; else the last
  std::vector<SegmentStart> starts_;                // of an adjoint run, of all segments but the first
  std::vector<AdjointScale> scales_;                // of those that were dropped, behind the first
  std::size_t most_kept_ = 0;
  long longest_ = 0;
  bool outgrown_ = false;
  AdjointGrowth growth_;  // of sessions that are gone
  struct Link {
    Jump jump;
    bool restart;  // nothing jumps
  };
  std::vector<Link> links_;  // between the sessions
  std::vector<MetEvent> met_;
  struct Sample {
    std::size_t index;
    double t;
    std::size_t session;
    std::vector<double> y, yp;
  };
  std::vector<Sample> samples_;  // in order of time
  std::vector<RunEvent> events_;
  ChatterWatch chatter_;
  Counters past_;  // of sessions that are gone
};

using IdaRun = SegmentedRun<IdaSession, DaeSystem>;
using CvodeRun = SegmentedRun<CvodeSession, OdeSystem>;

extern template class SegmentedRun<IdaSession, DaeSystem>;
extern template class SegmentedRun<CvodeSession, OdeSystem>;

}  // namespace costate
