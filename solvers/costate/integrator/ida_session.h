// One run of IDAS on a DAE system: set-up with exact Jacobians, cost quadrature, forward sensitivities, and the
// adjoint module with checkpoints. The methods in sensitivity/ are short programs on this.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "costate/formulation/step_plan.h"
#include "costate/integrator/adjoint_growth.h"
#include "costate/integrator/adjoint_scale.h"
#include "costate/integrator/checkpoints.h"
#include "costate/integrator/forward_state.h"
#include "costate/integrator/pace_watch.h"
#include "costate/integrator/segment.h"
#include "costate/integrator/stall_watch.h"
#include "costate/integrator/trajectory.h"
#include "costate/problem/problem.h"
#include "costate/sundials/callback_guard.h"
#include "costate/sundials/handles.h"
#include "costate/sundials/newton_operator.h"

namespace costate {

class IdaSession {
 public:
  /// Starts from the system's consistent start; with_sensitivities also finds its derivative.
  IdaSession(DaeSystem& system, const SolverOptions& options, Monitor monitor, bool with_start_derivative);
  /// Begins with a given state, in the mode that the system is in; options.t_start is replaced.
  IdaSession(DaeSystem& system, const SolverOptions& options, Monitor monitor, const SegmentStart& start);
  ~IdaSession();
  IdaSession(const IdaSession&) = delete;
  IdaSession& operator=(const IdaSession&) = delete;

  /// Adds psi's running part as a quadrature under error control.
  /// Steps keep within the plan's bounds; before anything else.
  void follow(std::shared_ptr<const StepPlan> plan);
  void enable_cost();
  void enable_sensitivities();
  /// Once the costs are enabled.
  void enable_adjoint(const CheckpointPlan& plan);

  /// Advances to t (interpolated output there).
  void advance(double t);
  /// The same with checkpoints for a backward run.
  void advance_with_checkpoints(double t);
  /// Solves the adjoint problem from t_end back to t_start and returns the gradient.
  std::vector<double> solve_adjoint();

  // Trajectories of several segments, each a session of its own (segmented_run.h).
  /// Advances to t by single steps, or to the end of the segment where that comes first: then false. Stores the motion
  /// (q, v, z) of each step in the trajectory, if there is one, and tells of each.
  bool advance_segment(double t, Trajectory* trajectory = nullptr, const StepSink& after_step = {});
  /// After that: the jump, and what the next segment begins with.
  void jump(Jump& jump, SegmentStart& start);
  /// The adjoint's end values; the integration from the end of this session's segment to its beginning; the gradient
  /// of the start; the way across a jump. All add to the gradient.
  AdjointState end_adjoint(std::vector<double>& gradient);
  void solve_backward(AdjointState& mu, const AdjointSize& size, std::vector<double>& gradient);
  void add_start_gradient(const AdjointState& mu, std::vector<double>& gradient) const;
  static void transfer_adjoint(DaeSystem& system, const Jump& jump, AdjointState& mu, std::vector<double>& gradient);
  const AdjointScale& adjoint_scale() const { return adjoint_scale_; }
  const AdjointGrowth& adjoint_growth() const { return adjoint_growth_; }

  const double* y() const { return y_.data(); }
  const double* yp() const { return yp_.data(); }
  double cost();                               // running part so far
  std::vector<double> sensitivity_gradient();  // of running and terminal part at the current time
  const Eigen::MatrixXd& start_rho() const { return y_rho_; }

  /// Fills the forward (and, after solve_adjoint, backward) counters.
  Counters counters() const { return counters_; }
  void read_forward_counters();

 private:
  /// Unknowns outside the norm get this absolute tolerance, so that their weight is practically zero.
  static constexpr double kUnweighted = 1e30;
  struct Backward {
    int which = -1;
    Vector y, yp, q, id, atol, atol_q;
    std::unique_ptr<NewtonOperator> newton;
    // The running cost's gradient, kept for further calls at the same time: Newton's iterations and the integrand of
    // the gradient come back to it.
    double cost_time = std::numeric_limits<double>::quiet_NaN();
    std::vector<double> g_y, g_rho;
    // Of the last unknown: Newton's coefficient, and what it is a sum of.
    double cj = 1;
    std::vector<double> sum_weights, integrand;
  };
  static IdaSession& self_of(void* p) { return *static_cast<IdaSession*>(p); }
  void record_step(double begin, double end, Trajectory& trajectory);
  void create_memory();
  void check(int flag, const char* what);
  [[noreturn]] void fail(void* memory, int flag, const std::string& what, const std::vector<Unknown>& names);
  /// In one-step mode the integrator counts no steps; this throws when the next one would exceed max_steps.
  void limit_steps();
  Vector absolute_tolerances(double scale) const;
  void poll(double t, bool backward);
  // A step that begins where this evaluation takes place, if it does, ends within the plan's bounds: its end is known
  // to the integrator before it chooses the step, in a repetition from a checkpoint as in the original.
  void look_ahead(double t, const double* y);
  void look_back(double t, const double* y);
  /// After a step that ends at t, where the plan asks for far shorter ones: a new session goes on (segment.h).
  bool was_too_long(double t) const;
  /// Before the run back: the times at which SUNDIALS has to stop on the way.
  void read_checkpoints();
  double stop() const { return std::min(options_.t_end, system_.segment_limit(start_time_)); }
  /// The forward state in a backward callback.
  const double* forward(double t, N_Vector y) { return forward_.at(t, costate::data(y), system_.size()); }
  /// g_y and g_rho in a backward callback.
  const Backward& backward_cost_gradient(double t, const double* x);
  int summed_back() const { return system_.parameter_count() > 0 ? 1 : 0; }
  void begin_sum();
  void backward_integrand(double t, const double* x, const double* mu, double* q);
  double backward_sum_rate(double t, const double* x, const double* mu);
  void solve_sum(double* x);
  std::vector<Unknown> names_back() const;
  /// Before a callback of the forward problem evaluates the system.
  void watch_forward();
  /// Zeroed, `count` entries.
  double* q_rho_buffer(int count) {
    g_rho_.assign(static_cast<std::size_t>(count), 0.0);
    return g_rho_.data();
  }

  static int residual(double t, N_Vector y, N_Vector yp, N_Vector r, void* self);
  static int jacobian(double t, double cj, N_Vector y, N_Vector yp, N_Vector r, SUNMatrix J, void* self, N_Vector,
                      N_Vector, N_Vector);
  static int quadrature(double t, N_Vector y, N_Vector yp, N_Vector q, void* self);
  static int sensitivity_residual(int count, double t, N_Vector y, N_Vector yp, N_Vector r, N_Vector* yS, N_Vector* ypS,
                                  N_Vector* rS, void* self, N_Vector, N_Vector, N_Vector);
  static int sensitivity_quadrature(int count, double t, N_Vector y, N_Vector yp, N_Vector* yS, N_Vector* ypS,
                                    N_Vector q, N_Vector* qS, void* self, N_Vector, N_Vector, N_Vector);
  static int backward_residual(double t, N_Vector y, N_Vector yp, N_Vector yB, N_Vector ypB, N_Vector rB, void* self);
  static int backward_jacobian(double t, double cj, N_Vector y, N_Vector yp, N_Vector yB, N_Vector ypB, N_Vector rB,
                               SUNMatrix J, void* self, N_Vector, N_Vector, N_Vector);
  static int backward_quadrature(double t, N_Vector y, N_Vector yp, N_Vector yB, N_Vector ypB, N_Vector qB, void* self);

  Context context_;
  DaeSystem& system_;
  SolverOptions options_;
  Monitor monitor_;
  CallbackGuard guard_;
  std::string message_;
  void* memory_ = nullptr;
  double ahead_of_ = std::numeric_limits<double>::quiet_NaN(), ahead_ = 0;  // the plan's last answer, and when
  bool restart_ = false;                                                    // the segment ends with no jump
  Vector y_, yp_, id_, atol_, q_;
  Eigen::MatrixXd y_rho_, yp_rho_, F_rho_;
  std::unique_ptr<NewtonOperator> newton_;
  VectorArray yS_, ypS_, qS_;
  std::vector<Vector> atol_S_;
  std::unique_ptr<Backward> backward_;
  std::optional<RepeatWatch> watch_;
  std::vector<double> g_y_, g_rho_;
  ForwardState forward_;
  AdjointScale adjoint_scale_;
  AdjointGrowth adjoint_growth_;
  StallWatch stall_;
  PaceWatch pace_, pace_back_;
  std::shared_ptr<const StepPlan> plan_;  // or null
  std::vector<double> checkpoint_times_;  // ascending
  double start_time_ = 0;
  long polls_ = 0, scale_samples_ = 0, steps_seen_ = 0;
  bool adjoint_ = false, ended_ = false;
  double t_ = 0, step_end_ = 0;
  SegmentStart start_;  // empty in the first segment
  Counters counters_;
};

}  // namespace costate
