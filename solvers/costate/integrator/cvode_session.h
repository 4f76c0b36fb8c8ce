// One run of CVODES on an ODE system: Newton with the system's exact I - gamma f_y, cost quadrature, forward
// sensitivities, and the adjoint module with checkpoints. The methods in sensitivity/ are short programs on this.
#pragma once

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
#include "costate/integrator/stiffness_watch.h"
#include "costate/integrator/trajectory.h"
#include "costate/problem/problem.h"
#include "costate/sundials/callback_guard.h"
#include "costate/sundials/handles.h"
#include "costate/sundials/newton_operator.h"

namespace costate {

class CvodeSession {
 public:
  /// What psi's running part is to CVODES: a quadrature, or a state of its own behind those of the system. Runs with
  /// sensitivities need the state: with Adams' method CVODES (6.4 to 7) forgets the quadratures of sensitivities when
  /// it changes the order (cvAdjustAdams), so that these start from memory that was never written.
  enum class Cost { quadrature, state };
  CvodeSession(OdeSystem& system, const SolverOptions& options, Monitor monitor, bool with_start_derivative,
               Cost cost = Cost::quadrature);
  /// Begins with a given state, in the mode that the system is in; options.t_start is replaced.
  CvodeSession(OdeSystem& system, const SolverOptions& options, Monitor monitor, const SegmentStart& start,
               Cost cost = Cost::quadrature);
  ~CvodeSession();
  CvodeSession(const CvodeSession&) = delete;
  CvodeSession& operator=(const CvodeSession&) = delete;

  /// Steps keep within the plan's bounds; before anything else.
  void follow(std::shared_ptr<const StepPlan> plan);
  void enable_cost();
  void enable_sensitivities();
  /// Once the costs are enabled.
  void enable_adjoint(const CheckpointPlan& plan);
  void advance(double t);
  void advance_with_checkpoints(double t);
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
  static void transfer_adjoint(OdeSystem& system, const Jump& jump, AdjointState& mu, std::vector<double>& gradient);
  const AdjointScale& adjoint_scale() const { return adjoint_scale_; }
  const AdjointGrowth& adjoint_growth() const { return adjoint_growth_; }

  const double* y() const { return y_.data(); }
  double cost();
  std::vector<double> sensitivity_gradient();
  Counters counters() const { return counters_; }
  void read_forward_counters();

 private:
  struct Backward {
    int which = -1;
    Vector y, q, atol, atol_q;
    std::unique_ptr<NewtonOperator> newton;
  };
  static CvodeSession& self_of(void* p) { return *static_cast<CvodeSession*>(p); }
  void record_step(double begin, double end, Trajectory& trajectory);
  void create_memory();
  void check(int flag, const char* what);
  [[noreturn]] void fail(void* memory, int flag, const std::string& what, const std::vector<Unknown>& names);
  /// In one-step mode the integrator counts no steps; this throws when the next one would exceed max_steps.
  void limit_steps();
  void poll(double t, bool backward);
  // A step that begins where this evaluation takes place, if it does, ends within the plan's bounds: its end is known
  // to the integrator before it chooses the step, in a repetition from a checkpoint as in the original.
  void look_ahead(double t, const double* y);
  void look_back(double t, const double* y);
  /// Throws StiffError where Adams' steps are bound by stability and very many of them are left.
  void watch_stiffness(double t, const double* y);
  /// Before the run back: the times at which SUNDIALS has to stop on the way.
  void read_checkpoints();
  double stop() const { return std::min(options_.t_end, system_.segment_limit(start_time_)); }
  /// The forward state in a backward callback.
  const double* forward(double t, N_Vector y) { return forward_.at(t, costate::data(y), system_.size()); }
  /// Before a callback of the forward problem evaluates the system.
  void watch_forward();
  int linear_multistep() const;
  std::vector<Unknown> names() const;
  /// Solves with I - gamma f_y, the cost's row included.
  void solve_newton(double* b);

  static int rhs(double t, N_Vector y, N_Vector f, void* self);
  static int newton_matrix(double t, N_Vector y, N_Vector f, SUNMatrix A, int jok, int* jcur, double gamma, void* self,
                           N_Vector, N_Vector, N_Vector);
  static int quadrature(double t, N_Vector y, N_Vector q, void* self);
  static int sensitivity_rhs(int count, double t, N_Vector y, N_Vector f, N_Vector* yS, N_Vector* fS, void* self,
                             N_Vector, N_Vector);
  static int backward_rhs(double t, N_Vector y, N_Vector yB, N_Vector fB, void* self);
  static int backward_newton_matrix(double t, N_Vector y, N_Vector yB, N_Vector fB, SUNMatrix A, int jok, int* jcur,
                                    double gamma, void* self, N_Vector, N_Vector, N_Vector);
  static int backward_quadrature(double t, N_Vector y, N_Vector yB, N_Vector qB, void* self);

  Context context_;
  OdeSystem& system_;
  SolverOptions options_;
  Monitor monitor_;
  CallbackGuard guard_;
  std::string message_;
  void* memory_ = nullptr;
  Vector y_, q_;
  Eigen::MatrixXd y_rho_;
  std::unique_ptr<NewtonOperator> newton_;
  VectorArray yS_;
  std::vector<const double*> columns_in_;
  std::vector<double*> columns_out_;
  std::unique_ptr<Backward> backward_;
  std::optional<RepeatWatch> watch_;
  std::vector<double> g_y_, g_rho_;
  ForwardState forward_;
  int size_ = 0;             // unknowns, the cost among them when it is one
  bool cost_state_ = false;  // the last unknown is psi' = g
  double gamma_ = 0;
  AdjointScale adjoint_scale_;
  AdjointGrowth adjoint_growth_;
  StallWatch stall_;
  PaceWatch pace_, pace_back_;
  StiffnessWatch stiffness_;
  std::shared_ptr<const StepPlan> plan_;  // or null
  std::vector<double> checkpoint_times_;  // ascending
  double start_time_ = 0;
  long polls_ = 0, scale_samples_ = 0, newton_setups_ = 0, backward_setups_ = 0;
  bool adjoint_ = false, ended_ = false;
  double t_ = 0, step_end_ = 0;
  SegmentStart start_;  // empty in the first segment
  Counters counters_;
};

}  // namespace costate
