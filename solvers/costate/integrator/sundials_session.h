// What a run of IDAS and one of CVODES have in common: set-up, advancing to a time or step by step, checkpoints, bounds
// of steps, the way across jumps, the way back, progress and interruption, limits, the report of a failure, counters.
// Api is IdaApi or CvodeApi (sundials/ida_api.h); what each integrator asks of its system is in IdaSession and
// CvodeSession.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "costate/formulation/solved_state.h"
#include "costate/formulation/step_plan.h"
#include "costate/integrator/adjoint_growth.h"
#include "costate/integrator/adjoint_scale.h"
#include "costate/integrator/checkpoints.h"
#include "costate/integrator/forward_state.h"
#include "costate/integrator/pace_watch.h"
#include "costate/integrator/segment.h"
#include "costate/integrator/stall_watch.h"
#include "costate/integrator/step_looks.h"
#include "costate/integrator/trajectory.h"
#include "costate/problem/problem.h"
#include "costate/sundials/callback_guard.h"
#include "costate/sundials/cvode_api.h"
#include "costate/sundials/handles.h"
#include "costate/sundials/ida_api.h"
#include "costate/sundials/newton_operator.h"

namespace costate {

template <class Api>
class SundialsSession {
 public:
  using SystemType = typename Api::SystemType;
  SundialsSession(const SundialsSession&) = delete;
  SundialsSession& operator=(const SundialsSession&) = delete;
  virtual ~SundialsSession();

  /// Steps keep within the plan's bounds; before anything else.
  void follow(std::shared_ptr<const StepPlan> plan);
  /// Of the first segment: what leaves a gap at the start comes back after this time.
  void meet_hop(double hop) { look_at_hop(start_, start_time_, hop); }
  /// Of the run, told of each step; or null.
  void follow(TouchWatch* touches) { touches_ = touches && !touches->empty() ? touches : nullptr; }
  /// The motion, and that of its adjoint, have derivatives of every order (is_smooth()).
  void follow_smooth_motion() {
    smooth_ = true;
    choose_smooth_steps(memory_);
  }
  /// Before a run back, whose steps keep within these bounds.
  void follow_back(std::shared_ptr<const StepPlan> plan) { plan_back_ = plan && !plan->empty() ? plan : nullptr; }
  /// Adds psi's running part under error control.
  void enable_cost();
  /// Keeps checkpoints for a run back from here on; once the costs are enabled.
  void enable_adjoint(const CheckpointPlan& plan);

  /// Advances to t (interpolated output there).
  void advance(double t);
  // Trajectories of several segments, each a session of its own (segmented_run.h).
  /// Advances to t by single steps, or to the end of the segment where that comes first: then false. Stores the motion
  /// (q, v, z) of each step in the trajectory, if there is one, and tells of each.
  bool advance_segment(double t, Trajectory* trajectory = nullptr, const StepSink& after_step = {});
  /// Advances to the end of a segment that has been run before, where that is known.
  void repeat_segment(double end);
  /// After advance_segment(): the jump, and what the next segment begins with.
  void jump(Jump& jump, SegmentStart& start);
  /// The adjoint's integration from the end of this session's segment to its beginning, across the stops on the way
  /// (the last one first); adds to the gradient.
  void solve_backward(AdjointState& mu, const AdjointSize& size, std::vector<double>& gradient,
                      const std::vector<AdjointStop>& stops = {});

  const double* y() const { return y_.data(); }
  /// Null where the system is explicit.
  const double* yp() const { return Api::implicit ? yp_.data() : nullptr; }
  /// psi's running part so far.
  double cost();
  const AdjointScale& adjoint_scale() const { return adjoint_scale_; }
  const AdjointGrowth& adjoint_growth() const { return adjoint_growth_; }
  /// Fills the forward counters; before a backward run, whose repetitions count on.
  void read_forward_counters();
  /// Forward and, after the backward run, backward.
  Counters counters() const { return counters_; }

 protected:
  /// t, within the last step of an integrator: IDAS takes its fuzz for quadratures off the beginning, instead of adding
  /// it, where time goes towards zero. A step shorter than that is left by it.
  static double within_last_step(void* memory, double t) {
    constexpr double kFuzz = 128 * std::numeric_limits<double>::epsilon();
    double end = 0, h = 0;
    Api::current_time(memory, &end);
    Api::last_step(memory, &h);
    const double fuzz = end * h < 0 ? std::copysign(kFuzz * (std::abs(end) + std::abs(h)), h) : 0;
    return h < 0 ? std::min(t, end - h + fuzz) : std::max(t, end - h + fuzz);
  }
  /// Unknowns outside the norm get this absolute tolerance, so that their weight is practically zero.
  static constexpr double kUnweighted = 1e30;
  /// A step that begins where a force or an acceleration jumps may have to become very short.
  static constexpr int kMostFailedErrorTests = 30;

  SundialsSession(SystemType& system, const SolverOptions& options, Monitor monitor, double t)
      : system_(system), options_(options), monitor_(std::move(monitor)), start_time_(t), t_(t), step_end_(t) {
    options_.t_start = t;
  }

  struct Backward {
    int which = -1;
    Vector y, yp, q, atol, atol_q;  // yp of implicit systems only
    AdjointUnits units;
    std::unique_ptr<NewtonOperator> newton;
    void* memory = nullptr;
  };

  // The integrator's own side.
  /// The pointer that its callbacks get.
  virtual void* self() = 0;
  /// The names of its unknowns, of the system's and what it has besides, forward and backward.
  virtual std::vector<Unknown> names() const { return system_.unknowns(); }
  virtual std::vector<Unknown> names_back() const = 0;
  /// b := the solution of Newton's system that was factored last.
  virtual void solve_newton(double* b) = 0;
  virtual void solve_newton_back(double* b) = 0;
  virtual typename Api::Quadrature quadrature_function() const = 0;
  virtual typename Api::BackwardQuadrature backward_quadrature_function() const = 0;
  /// The system's own adjoint begins with what is in back_; creates its memory there, but for its matrix.
  virtual void create_backward() = 0;
  virtual void set_backward_matrix() = 0;
  /// Of a run, or a run back, of a smooth motion.
  virtual void choose_smooth_steps(void*) {}
  /// How often the way back may be tried (attempts_back.h), and what is set for one.
  virtual int attempts_back() const { return 1; }
  virtual void begin_attempt_back(int) {}
  /// After the adjoint in back_ has changed: what the session has beside the system's own adjoint.
  virtual void complete_backward(const AdjointStop&) {}
  /// Whether psi is one of the unknowns, behind those of the system; else it is a quadrature.
  virtual bool cost_is_unknown() const { return false; }
  /// After each step: whether a new session is to go on in which a clock leads the order.
  virtual bool asks_for_lead() { return false; }
  /// At the end of the run: unknowns that are not integrated.
  virtual void complete_end() {}
  /// Columns of sensitivities at the end of a segment become those that the next one begins with.
  virtual void jump_sensitivities(const Jump& jump, SegmentStart& start) = 0;

  /// Takes the memory; and, once it is initialized, what is set for both, and Newton's operator.
  void open(void* memory);
  void set_up();
  void check(int flag, const char* what);
  [[noreturn]] void fail(bool backward, int flag, const std::string& what);

  // For callbacks.
  /// At every evaluation: ends a run that no longer gets on, and tells of its progress.
  void poll(double t, bool backward);
  /// Before a callback of the forward problem evaluates the system.
  void watch_forward();
  // A step that begins where this evaluation takes place, if it does, ends within the plan's bounds: its end is known
  // to the integrator before it chooses the step, in a repetition from a checkpoint as in the original.
  void look_ahead(double t, const double* y);
  void look_back(double t, const double* y);
  /// The forward state in a backward callback.
  const double* forward(double t, N_Vector y) { return forward_.at(t, costate::data(y), system_.size()); }
  /// The running cost at x, which y gives; samples the adjoint's size on the way.
  double running_cost(double t, const double* x);
  long steps(void* memory) const {
    long count = 0;
    Api::steps(memory, &count);
    return count;
  }

  Context context_;
  SystemType& system_;
  SolverOptions options_;
  Monitor monitor_;
  CallbackGuard guard_;
  void* memory_ = nullptr;
  Vector y_, yp_, q_;  // yp of implicit systems only
  VectorArray yS_, ypS_;
  std::unique_ptr<NewtonOperator> newton_;
  std::unique_ptr<Backward> back_;
  std::optional<RepeatWatch> watch_;
  std::vector<double> g_y_;
  AdjointGrowth adjoint_growth_;
  long checkpoint_steps_ = 0;               // of an adjoint that is not yet initialized
  bool adjoint_ = false, restart_ = false;  // restart_: the segment ends with no jump
  double start_time_, t_;
  long newton_setups_ = 0, newton_setups_back_ = 0;
  SegmentStart start_;  // empty in the first segment
  Counters counters_;

 private:
  /// In one-step mode the integrator counts no steps; this throws when the next one would exceed max_steps.
  void limit_steps();
  double stop() const { return std::min(options_.t_end, system_.segment_limit(start_time_)); }
  /// Where a step from the state at t ends at the latest, by the plan and by touches that are looked at closely.
  bool bounded() const { return plan_ || start_.look.to > start_time_; }
  double limit(double t, const double* y);
  /// Of the step just taken: whether it has passed over a touch; it then ends earlier, and a new session goes on.
  bool passed_over(double begin);
  /// After a step that ends at t, where the plan asks for far shorter ones: a new session goes on (segment.h).
  bool was_too_long(double t) const;
  /// The step that ended at t, 0 where none did.
  double last_step(double t) const;
  long error_test_failures() const;
  /// Of the step just taken, behind one of the size `before` that ended where the plan had asked for it, with the
  /// failures counted until then: its error was estimated for the smoother motion before (segment.h). It is taken back,
  /// and a new session goes on.
  bool fell(double before, long failures) const;
  /// The start of another session at t, as the steps before it have it.
  void remember(double t);
  void solve(double to, double* reached, bool one_step);
  void interpolate(double t);
  /// y at a time of the step just taken, whose own end y_ is at.
  const double* within_step(double t, double own_end);
  void record_step(double begin, double end, Trajectory& trajectory);
  /// Before the run back: the times at which SUNDIALS has to stop on the way.
  void read_checkpoints();
  /// Where the adjoint begins, or begins anew: IDAS chooses its first step without an evaluation.
  void bound_first_step_back(double t, const double* y);
  void set_tolerances_back(const AdjointState& mu, const AdjointSize& expected, const double* y);
  void open_backward();
  /// The way back begins before this stretch.
  void end_at(const AdjointStop& stop);
  void begin_again_back(const AdjointState& mu, const AdjointSize& expected);
  /// To a stop; to one where nothing jumps but rates, no step leads beyond it.
  void integrate_to(const AdjointStop& stop, AdjointState& mu);
  void integrate_back(double to, AdjointState& mu);
  void restart_back(AdjointStop stop, const AdjointState& mu, const AdjointSize& expected);
  void count_back();
  /// After so many steps of the way back: ends it where they are a hundred times those of the motion because their
  /// error test fails again and again.
  void watch_noise_back(long taken);

  std::string message_;
  std::shared_ptr<const StepPlan> plan_, plan_back_;  // or null
  TouchWatch* touches_ = nullptr;
  bool smooth_ = false;
  StepLooks<Vector> looks_{[this] { return Vector(y_.size(), context_); }};
  std::optional<TouchLook> passed_;                                         // at the end of the segment
  double ahead_of_ = std::numeric_limits<double>::quiet_NaN(), ahead_ = 0;  // the plan's last answer, and when
  double place_ = std::numeric_limits<double>::quiet_NaN();                 // the last time that the plan had asked for
  std::vector<double> checkpoint_times_;                                    // ascending
  bool kinks_back_ = false;                                                 // whether the way back has such stops
  double kink_back_ = -std::numeric_limits<double>::infinity();             // the next of them
  ForwardState forward_;
  AdjointScale adjoint_scale_;
  StallWatch stall_;
  PaceWatch pace_, pace_back_;
  std::optional<std::pair<Jump, SegmentStart>> begun_;  // at the place where the last step began
  long polls_ = 0, steps_back_ = 0;                     // steps_back_: before the adjoint's last restart
  bool ended_ = false;
  double step_end_;
};

extern template class SundialsSession<IdaApi>;
extern template class SundialsSession<CvodeApi>;

}  // namespace costate
