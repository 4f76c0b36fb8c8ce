#include "costate/integrator/cvode_session.h"

#include <cvodes/cvodes.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/integrator/unknown_sizes.h"
#include "costate/sundials/failure.h"
#include "costate/sundials/message_capture.h"

namespace costate {

namespace {
std::string cvode_flag_name(int flag) {
  char* name = CVodeGetReturnFlagName(flag);
  std::string text = name ? name : std::to_string(flag);
  free(name);
  return text;
}
}  // namespace

CvodeSession::CvodeSession(OdeSystem& system, const SolverOptions& options, Monitor monitor, bool with_start_derivative,
                           Cost cost)
    : system_(system),
      options_(options),
      monitor_(std::move(monitor)),
      cost_state_(cost == Cost::state && system.has_running_cost()),
      t_(options.t_start) {
  const int n = system.size();
  size_ = n + (cost_state_ ? 1 : 0);
  y_ = Vector(size_, context_);
  g_y_.assign(static_cast<std::size_t>(n), 0);
  const bool derivative = with_start_derivative && system.parameter_count() > 0;
  system.start(options.t_start, y_.data(), derivative ? &y_rho_ : nullptr);
  create_memory();
}

CvodeSession::CvodeSession(OdeSystem& system, const SolverOptions& options, Monitor monitor, const SegmentStart& start,
                           Cost cost)
    : system_(system),
      options_(options),
      monitor_(std::move(monitor)),
      cost_state_(cost == Cost::state && system.has_running_cost()),
      t_(start.t),
      start_(start) {
  options_.t_start = start.t;
  size_ = static_cast<int>(start.y.size());
  y_ = Vector(size_, context_);
  g_y_.assign(static_cast<std::size_t>(system.size()), 0);
  std::copy(start.y.begin(), start.y.end(), y_.data());
  create_memory();
}

void CvodeSession::create_memory() {
  step_end_ = start_time_ = t_;
  memory_ = CVodeCreate(linear_multistep(), context_);
  if (!memory_) throw SolverError("CVODES could not be created.");
  capture_cvode_messages(memory_, message_);
  check(CVodeInit(memory_, rhs, t_, y_), "CVodeInit");
  check(CVodeSetUserData(memory_, this), "CVodeSetUserData");
  Vector atol(size_, context_);  // SUNDIALS copies it
  fill_absolute_tolerances(system_, options_.absolute(), size_, atol.data());
  check(CVodeSVtolerances(memory_, options_.rtol, atol), "CVodeSVtolerances");
  check(CVodeSetMaxNumSteps(memory_, options_.max_steps), "CVodeSetMaxNumSteps");
  // A step that begins where a force or an acceleration jumps may have to become very short.
  check(CVodeSetMaxErrTestFails(memory_, 30), "CVodeSetMaxErrTestFails");
  if (options_.max_step_s > 0) check(CVodeSetMaxStep(memory_, options_.max_step_s), "CVodeSetMaxStep");
  check(CVodeSetStopTime(memory_, stop()), "CVodeSetStopTime");
  newton_ = std::make_unique<NewtonOperator>(context_, guard_, [this](double* b) { solve_newton(b); });
  check(CVodeSetLinearSolver(memory_, newton_->solver(), newton_->matrix()), "CVodeSetLinearSolver");
  check(CVodeSetLinSysFn(memory_, newton_matrix), "CVodeSetLinSysFn");
}

CvodeSession::~CvodeSession() {
  if (memory_) CVodeFree(&memory_);
}

int CvodeSession::linear_multistep() const { return options_.cvodes_method == "adams" ? CV_ADAMS : CV_BDF; }

void CvodeSession::check(int flag, const char* what) {
  if (flag >= 0) return;
  guard_.rethrow();
  throw SolverError(fmt::format("{} failed [{}]. {}", what, cvode_flag_name(flag), message_));
}

void CvodeSession::fail(void* memory, int flag, const std::string& what, const std::vector<Unknown>& names) {
  guard_.rethrow();
  const int n = static_cast<int>(names.size());
  Vector weights(n, context_), errors(n, context_), rates(n, context_);
  FailureContext c;
  c.what = what;
  c.flag = cvode_flag_name(flag);
  c.message = message_;
  if ((flag == CV_CONV_FAILURE || flag == CV_REPTD_RHSFUNC_ERR || flag == CV_FIRST_RHSFUNC_ERR) &&
      !guard_.last_step_error().empty())
    c.message = guard_.last_step_error();
  CVodeGetErrWeights(memory, weights);
  CVodeGetEstLocalErrors(memory, errors);
  CVodeGetCurrentTime(memory, &c.t);
  CVodeGetCurrentStep(memory, &c.step);
  CVodeGetNumSteps(memory, &c.steps);
  c.weights = weights.data();
  c.errors = errors.data();
  if (CVodeGetDky(memory, c.t, 1, rates) >= 0) c.rates = rates.data();
  throw SolverError(failure_report(c, names));
}

void CvodeSession::limit_steps() {
  long steps = 0;
  CVodeGetNumSteps(memory_, &steps);
  if (steps >= options_.max_steps) fail(memory_, CV_TOO_MUCH_WORK, "CVODES reached its limit of steps", names());
}

std::vector<Unknown> CvodeSession::names() const {
  std::vector<Unknown> r = system_.unknowns();
  if (cost_state_) r.push_back({"psi", "1", Unknown::Role::force_state, true, true});
  return r;
}

void CvodeSession::solve_newton(double* b) {
  system_.solve(b);
  if (!cost_state_) return;
  const int n = system_.size();
  double g = 0;
  for (int i = 0; i < n; ++i) g += g_y_[i] * b[i];
  b[n] += gamma_ * g;
}

void CvodeSession::watch_forward() {
  if (!watch_) return;
  long steps = 0;
  CVodeGetNumSteps(memory_, &steps);
  watch_->forward(steps);
}

void CvodeSession::poll(double t, bool backward) {
  if (stall_.stalled(t)) {
    void* memory = backward ? CVodeGetAdjCVodeBmem(memory_, backward_->which) : memory_;
    fail(memory, CV_ERR_FAILURE, "CVODES no longer gets on", backward ? adjoint_names(system_.unknowns()) : names());
  }
  long steps = 0;
  void* memory = backward ? CVodeGetAdjCVodeBmem(memory_, backward_->which) : memory_;
  CVodeGetNumSteps(memory, &steps);
  if (const double all = (backward ? pace_back_ : pace_)
                             .projected(t, steps, backward ? options_.t_start : options_.t_end, options_.max_steps);
      all > 0)
    fail(memory, CV_TOO_MUCH_WORK, pace_message("CVODES", all, options_.max_steps),
         backward ? adjoint_names(system_.unknowns()) : names());
  if (!monitor_ || ++polls_ % 64 != 0) return;
  CVodeGetNumSteps(memory_, &steps);
  monitor_(t, steps, backward);
}

void CvodeSession::follow(std::shared_ptr<const StepPlan> plan) {
  plan_ = plan && !plan->empty() ? std::move(plan) : nullptr;
}

void CvodeSession::look_ahead(double t, const double* y) {
  if (plan_) CVodeSetStopTime(memory_, std::min(stop(), plan_->limit(system_, t, y, false)));
}

void CvodeSession::watch_stiffness(double t, const double* y) {
  constexpr double few = 2e5;  // steps that may as well be taken
  if (linear_multistep() != CV_ADAMS) return;
  long steps = 0;
  CVodeGetNumSteps(memory_, &steps);
  if (!stiffness_.due(steps)) return;
  double h = 0;
  int q = 0;
  CVodeGetLastStep(memory_, &h);
  CVodeGetLastOrder(memory_, &q);
  if (!(options_.t_end - t > few * h)) return;
  const double rate = stiffness_.bound_by(system_, t, y, h, q);
  if (!(rate > 0)) return;
  throw StiffError(
      fmt::format("The motion is stiff at t = {:.6g} s: after {} steps Adams' method still takes steps of {:.3g} "
                  "s, the size at which it is stable, for a rate of {:.3g} 1/s (a light mass, a stiff damper or "
                  "spring); about {:.2g} more would follow. Take CVODES's BDF (--cvodes-method bdf) or a "
                  "formulation on IDAS.",
                  t, steps, h, rate, (options_.t_end - t) / h));
}

void CvodeSession::enable_cost() {
  if (!system_.has_running_cost() || cost_state_) return;
  q_ = Vector(1, context_);
  q_.data()[0] = start_.cost;
  check(CVodeQuadInit(memory_, quadrature, q_), "CVodeQuadInit");
  check(CVodeQuadSStolerances(memory_, options_.rtol, options_.absolute() * cost_size(system_)),
        "CVodeQuadSStolerances");
  check(CVodeSetQuadErrCon(memory_, SUNTRUE), "CVodeSetQuadErrCon");
}

void CvodeSession::enable_sensitivities() {
  const int n = system_.size(), np = system_.parameter_count();
  if (np == 0) return;
  yS_ = VectorArray(np, size_, context_);
  VectorArray atol(np, size_, context_);
  for (int j = 0; j < np; ++j) {
    if (start_.s.empty())
      std::copy(y_rho_.col(j).data(), y_rho_.col(j).data() + n, yS_.data(j));
    else
      std::copy(start_.s[j].begin(), start_.s[j].end(), yS_.data(j));
    fill_absolute_tolerances(system_, options_.absolute() / system_.parameters().parameters[j].scale, size_,
                             atol.data(j));
  }
  columns_in_.resize(static_cast<std::size_t>(np));
  columns_out_.resize(static_cast<std::size_t>(np));
  g_rho_.resize(static_cast<std::size_t>(np));
  check(CVodeSensInit(memory_, np, options_.staggered ? CV_STAGGERED : CV_SIMULTANEOUS, sensitivity_rhs, yS_.handles()),
        "CVodeSensInit");
  check(CVodeSensSVtolerances(memory_, options_.rtol, atol.handles()), "CVodeSensSVtolerances");
  check(CVodeSetSensErrCon(memory_, SUNTRUE), "CVodeSetSensErrCon");
}

void CvodeSession::enable_adjoint(const CheckpointPlan& plan) {
  adjoint_ = true;
  watch_.emplace(system_, plan);
  check(CVodeAdjInit(memory_, plan.steps, CV_POLYNOMIAL), "CVodeAdjInit");
}

void CvodeSession::advance(double t) {
  if (t <= t_) return;
  double reached = t_;
  const int flag = CVode(memory_, t, y_, &reached, CV_NORMAL);
  if (flag < 0) fail(memory_, flag, "CVODES could not continue the simulation", names());
  t_ = reached;
}

void CvodeSession::record_step(double begin, double end, Trajectory& trajectory) {
  int order = 0;
  CVodeGetLastOrder(memory_, &order);
  Vector at(size_, context_);
  if (!system_.begins_with_motion()) {
    trajectory.add_step(begin, end, order, [&](double t) {
      check(CVodeGetDky(memory_, t, 0, at), "CVodeGetDky");
      return system_.kinematic_state(t, at.data());
    });
    return;
  }
  std::vector<std::vector<double>> d(static_cast<std::size_t>(order) + 1);
  for (int k = 0; k <= order; ++k) {
    check(CVodeGetDky(memory_, end, k, at), "CVodeGetDky");
    d[static_cast<std::size_t>(k)].assign(at.data(), at.data() + trajectory.width());
  }
  trajectory.add_step(begin, end, d, order);
}

void CvodeSession::advance_with_checkpoints(double t) {
  int checkpoints = 0;
  double reached = t_;
  const int flag = CVodeF(memory_, t, y_, &reached, CV_NORMAL, &checkpoints);
  if (flag < 0) fail(memory_, flag, "CVODES could not continue the simulation", names());
  t_ = reached;
  counters_.checkpoints = checkpoints;
}

bool CvodeSession::advance_segment(double t, Trajectory* trajectory, const StepSink& after_step) {
  const double known = step_end_;  // y_ may hold an earlier time of the step that ends there
  while (step_end_ < t) {
    if (ended_) {
      check(CVodeGetDky(memory_, step_end_, 0, y_), "CVodeGetDky");
      t_ = step_end_;
      return false;
    }
    limit_steps();
    int checkpoints = 0;
    const double begin = step_end_;
    // What the repetitions begin with is the end of all; the next step is bounded already.
    if (plan_ && adjoint_) CVodeSetStopTime(memory_, stop());
    const int flag = adjoint_ ? CVodeF(memory_, options_.t_end, y_, &step_end_, CV_ONE_STEP, &checkpoints)
                              : CVode(memory_, options_.t_end, y_, &step_end_, CV_ONE_STEP);
    if (flag < 0) fail(memory_, flag, "CVODES could not continue the simulation", names());
    if (adjoint_) counters_.checkpoints = checkpoints;
    const auto event = system_.find_event(begin, step_end_, [&](double at) {
      check(CVodeGetDky(memory_, at, 0, y_), "CVodeGetDky");
      return y();
    });
    if (event) step_end_ = *event;
    if (system_.has_events()) check(CVodeGetDky(memory_, step_end_, 0, y_), "CVodeGetDky");
    ended_ = event || system_.segment_ends(step_end_, y());
    if (trajectory) record_step(begin, step_end_, *trajectory);
    // Last: it may throw, and the run be gone on with.
    if (after_step) after_step(step_end_, y());
  }
  if (t < step_end_ || (t_ < t && t == known)) check(CVodeGetDky(memory_, t, 0, y_), "CVodeGetDky");
  t_ = t;
  return true;
}

void CvodeSession::jump(Jump& jump, SegmentStart& start) {
  const int n = system_.size();
  jump.t = t_;
  jump.event = system_.pending_event();
  start.t = system_.segment_start(t_);
  jump.before = system_.mode();
  jump.y.assign(y(), y() + n);
  start.y.assign(y(), y() + size_);
  system_.jump(t_, start.y.data());
  jump.after = system_.mode();
  start.cost = cost();
  system_.forget_event();
  if (yS_.count() == 0) return;
  check(CVodeGetSensDky(memory_, t_, 0, yS_.handles()), "CVodeGetSensDky");
  std::vector<double*> columns;
  start.s.resize(static_cast<std::size_t>(yS_.count()));
  for (int j = 0; j < yS_.count(); ++j) {
    start.s[j].assign(yS_.data(j), yS_.data(j) + size_);
    columns.push_back(start.s[j].data());
  }
  system_.jump_tangent(jump, columns.data(), yS_.count());
  if (cost_state_)
    for (std::size_t j = 0; j < system_.jump_cost_tangent().size(); ++j)
      start.s[j][static_cast<std::size_t>(n)] += system_.jump_cost_tangent()[j];
}

double CvodeSession::cost() {
  if (!system_.has_running_cost()) return 0;
  if (cost_state_) return y_.data()[system_.size()];
  check(CVodeGetQuadDky(memory_, t_, 0, q_), "CVodeGetQuadDky");
  return q_.data()[0];
}

std::vector<double> CvodeSession::sensitivity_gradient() {
  const int np = system_.parameter_count();
  std::vector<double> gradient(static_cast<std::size_t>(np), 0);
  if (np == 0) return gradient;
  check(CVodeGetSensDky(memory_, t_, 0, yS_.handles()), "CVodeGetSensDky");
  if (cost_state_)
    for (int j = 0; j < np; ++j) gradient[j] = yS_.data(j)[system_.size()];
  if (!system_.objective().terminal.empty()) {
    std::vector<double> terminal(static_cast<std::size_t>(np));
    for (int j = 0; j < np; ++j) columns_in_[j] = yS_.data(j);
    system_.tangent_terminal_cost(t_, y(), columns_in_.data(), terminal.data(), np);
    for (int j = 0; j < np; ++j) gradient[j] += terminal[j];
  }
  return gradient;
}

void CvodeSession::read_forward_counters() {
  Counters& c = counters_;
  CVodeGetNumSteps(memory_, &c.steps);
  CVodeGetNumRhsEvals(memory_, &c.residuals);
  CVodeGetNumNonlinSolvIters(memory_, &c.newton_iterations);
  CVodeGetNumErrTestFails(memory_, &c.error_test_failures);
  CVodeGetNumNonlinSolvConvFails(memory_, &c.convergence_failures);
  if (yS_.count() > 0) CVodeGetSensNumRhsEvals(memory_, &c.sensitivity_residuals);
  c.jacobians = newton_setups_;
  c.factorizations = system_.factorizations();
  c.position_iterations = system_.position_iterations();
  c.simulations = 1;
}

int CvodeSession::rhs(double t, N_Vector y, N_Vector f, void* p) {
  CvodeSession& s = self_of(p);
  return s.guard_.run([&] {
    s.poll(t, false);
    s.watch_forward();
    s.system_.rhs(t, data(y), data(f));
    if (s.cost_state_) data(f)[s.system_.size()] = s.system_.running_cost(t, data(y));
    s.look_ahead(t, data(y));
    s.watch_stiffness(t, data(y));
  });
}

int CvodeSession::newton_matrix(double t, N_Vector y, N_Vector, SUNMatrix, int, int* jcur, double gamma, void* p,
                                N_Vector, N_Vector, N_Vector) {
  CvodeSession& s = self_of(p);
  ++s.newton_setups_;
  *jcur = SUNTRUE;
  return s.guard_.run([&] {
    s.watch_forward();
    s.system_.factor(t, data(y), gamma);
    if (!s.cost_state_) return;
    s.gamma_ = gamma;
    s.system_.running_cost_gradient(t, data(y), s.g_y_.data());
  });
}

int CvodeSession::quadrature(double t, N_Vector y, N_Vector q, void* p) {
  CvodeSession& s = self_of(p);
  return s.guard_.run([&] {
    s.watch_forward();
    data(q)[0] = s.system_.running_cost(t, data(y));
    if (!s.adjoint_ || s.scale_samples_++ % 8 != 0) return;
    s.system_.running_cost_gradient(t, data(y), s.g_y_.data());
    s.adjoint_scale_.sample(data(y), s.g_y_, s.system_.unknowns());
  });
}

int CvodeSession::sensitivity_rhs(int count, double t, N_Vector y, N_Vector, N_Vector* yS, N_Vector* fS, void* p,
                                  N_Vector, N_Vector) {
  CvodeSession& s = self_of(p);
  return s.guard_.run([&] {
    for (int j = 0; j < count; ++j) {
      s.columns_in_[j] = data(yS[j]);
      s.columns_out_[j] = data(fS[j]);
    }
    s.system_.tangent(t, data(y), s.columns_in_.data(), s.columns_out_.data(), count, true);
    if (!s.cost_state_) return;
    s.system_.tangent_running_cost(t, data(y), s.columns_in_.data(), s.g_rho_.data(), count);
    for (int j = 0; j < count; ++j) data(fS[j])[s.system_.size()] = s.g_rho_[j];
  });
}

}  // namespace costate
