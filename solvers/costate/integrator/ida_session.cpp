#include "costate/integrator/ida_session.h"

#include <fmt/format.h>
#include <idas/idas.h>

#include <algorithm>
#include <cmath>

#include "costate/integrator/error_weights.h"
#include "costate/integrator/solved_algebraic.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/sundials/failure.h"
#include "costate/sundials/message_capture.h"

namespace costate {

namespace {
std::string ida_flag_name(int flag) {
  char* name = IDAGetReturnFlagName(flag);
  std::string text = name ? name : std::to_string(flag);
  free(name);  // the caller owns it
  return text;
}

/// The state at which a running cost is taken. The result lives until the next call in the thread.
const double* cost_state(DaeSystem& system, double t, const double* y) {
  if (!system.objective().running_needs_accelerations()) return y;
  thread_local SolvedAlgebraic at_state;
  at_state.forget();
  return at_state.at(system, t, y);
}

}  // namespace

IdaSession::IdaSession(DaeSystem& system, const SolverOptions& options, Monitor monitor, bool with_start_derivative)
    : system_(system), options_(options), monitor_(std::move(monitor)), t_(options.t_start) {
  const int n = system.size();
  y_ = Vector(n, context_);
  yp_ = Vector(n, context_);
  const bool derivative = with_start_derivative && system.parameter_count() > 0;
  system.start(options.t_start, y_.data(), yp_.data(), derivative ? &y_rho_ : nullptr, derivative ? &yp_rho_ : nullptr);
  create_memory();
}

IdaSession::IdaSession(DaeSystem& system, const SolverOptions& options, Monitor monitor, const SegmentStart& start)
    : system_(system), options_(options), monitor_(std::move(monitor)), t_(start.t), start_(start) {
  options_.t_start = start.t;
  y_ = Vector(system.size(), context_);
  yp_ = Vector(system.size(), context_);
  std::copy(start.y.begin(), start.y.end(), y_.data());
  std::copy(start.yp.begin(), start.yp.end(), yp_.data());
  create_memory();
}

void IdaSession::create_memory() {
  const int n = system_.size();
  step_end_ = start_time_ = t_;
  id_ = Vector(n, context_);
  g_y_.assign(static_cast<std::size_t>(n), 0);
  bool algebraic = false;
  for (int i = 0; i < n; ++i) {
    id_.data()[i] = system_.unknowns()[i].differential ? 1 : 0;
    algebraic = algebraic || !system_.unknowns()[i].differential;
  }
  atol_ = absolute_tolerances(options_.absolute());
  memory_ = IDACreate(context_);
  if (!memory_) throw SolverError("IDAS could not be created.");
  capture_ida_messages(memory_, message_);
  check(IDAInit(memory_, residual, t_, y_, yp_), "IDAInit");
  check(IDASetUserData(memory_, this), "IDASetUserData");
  check(IDAWFtolerances(memory_,
                        [](N_Vector y, N_Vector w, void* p) {
                          IdaSession& s = self_of(p);
                          double h = 0;
                          long steps = 0;
                          IDAGetNumSteps(s.memory_, &steps);
                          if (steps > 0) IDAGetCurrentStep(s.memory_, &h);  // else what another run has left
                          return set_error_weights(s.system_.unknowns(), costate::data(y), s.options_.rtol,
                                                   s.atol_.data(), h, costate::data(w));
                        }),
        "IDAWFtolerances");
  check(IDASetMaxNumSteps(memory_, options_.max_steps), "IDASetMaxNumSteps");
  // A step that begins where a force or an acceleration jumps may have to become very short.
  check(IDASetMaxErrTestFails(memory_, 30), "IDASetMaxErrTestFails");
  if (options_.max_step_s > 0) check(IDASetMaxStep(memory_, options_.max_step_s), "IDASetMaxStep");
  check(IDASetId(memory_, id_), "IDASetId");
  if (algebraic) check(IDASetSuppressAlg(memory_, SUNTRUE), "IDASetSuppressAlg");
  check(IDASetStopTime(memory_, stop()), "IDASetStopTime");
  newton_ = std::make_unique<NewtonOperator>(context_, guard_, [this](double* b) { system_.solve(b); });
  check(IDASetLinearSolver(memory_, newton_->solver(), newton_->matrix()), "IDASetLinearSolver");
  check(IDASetJacFn(memory_, jacobian), "IDASetJacFn");
}

IdaSession::~IdaSession() {
  if (memory_) IDAFree(&memory_);
}

Vector IdaSession::absolute_tolerances(double scale) const {
  Vector v(system_.size(), context_);
  const auto sizes = unknown_sizes(system_);
  for (std::size_t i = 0; i < sizes.size(); ++i)
    v.data()[i] = system_.unknowns()[i].in_norm ? scale * sizes[i] : kUnweighted;
  return v;
}

void IdaSession::check(int flag, const char* what) {
  if (flag >= 0) return;
  guard_.rethrow();
  throw SolverError(fmt::format("{} failed [{}]. {}", what, ida_flag_name(flag), message_));
}

void IdaSession::fail(void* memory, int flag, const std::string& what, const std::vector<Unknown>& names) {
  guard_.rethrow();
  const int n = static_cast<int>(names.size());
  Vector weights(n, context_), errors(n, context_), rates(n, context_);
  FailureContext c;
  c.what = what;
  c.flag = ida_flag_name(flag);
  c.message = message_;
  if ((flag == IDA_CONV_FAIL || flag == IDA_REP_RES_ERR || flag == IDA_FIRST_RES_FAIL) &&
      !guard_.last_step_error().empty())
    c.message = guard_.last_step_error();
  IDAGetErrWeights(memory, weights);
  IDAGetEstLocalErrors(memory, errors);
  IDAGetCurrentTime(memory, &c.t);
  IDAGetCurrentStep(memory, &c.step);
  IDAGetNumSteps(memory, &c.steps);
  c.weights = weights.data();
  c.errors = errors.data();
  if (IDAGetDky(memory, c.t, 1, rates) >= 0) c.rates = rates.data();
  throw SolverError(failure_report(c, names));
}

void IdaSession::limit_steps() {
  long steps = 0;
  IDAGetNumSteps(memory_, &steps);
  if (start_.steps + steps >= options_.max_steps)
    fail(memory_, IDA_TOO_MUCH_WORK, "IDAS reached its limit of steps", system_.unknowns());
}

void IdaSession::watch_forward() {
  if (!watch_) return;
  long steps = 0;
  IDAGetNumSteps(memory_, &steps);
  watch_->forward(steps);
}

void IdaSession::poll(double t, bool backward) {
  if (stall_.stalled(t)) {
    void* memory = backward ? IDAGetAdjIDABmem(memory_, backward_->which) : memory_;
    fail(memory, IDA_ERR_FAIL, "IDAS no longer gets on", backward ? names_back() : system_.unknowns());
  }
  long steps = 0;
  void* memory = backward ? IDAGetAdjIDABmem(memory_, backward_->which) : memory_;
  IDAGetNumSteps(memory, &steps);
  if (const double all = (backward ? pace_back_ : pace_)
                             .projected(t, steps, backward ? options_.t_start : options_.t_end, options_.max_steps);
      all > 0)
    fail(memory, IDA_TOO_MUCH_WORK, pace_message("IDAS", all, options_.max_steps),
         backward ? names_back() : system_.unknowns());
  if (!monitor_ || ++polls_ % 64 != 0) return;
  IDAGetNumSteps(memory_, &steps);
  monitor_(t, steps, backward);
}

void IdaSession::follow(std::shared_ptr<const StepPlan> plan) {
  plan_ = plan && !plan->empty() ? std::move(plan) : nullptr;
  if (!plan_) return;
  // Without an evaluation IDAS chooses its first step; the first evaluation lifts this bound (look_ahead).
  const double first = plan_->limit(system_, t_, y(), false) - t_;
  if (std::isfinite(first) && !(options_.max_step_s > 0 && options_.max_step_s < first))
    check(IDASetMaxStep(memory_, first), "IDASetMaxStep");
}

void IdaSession::look_ahead(double t, const double* y) {
  if (!plan_) return;
  IDASetMaxStep(memory_, std::max(0.0, options_.max_step_s));
  ahead_of_ = t;
  ahead_ = plan_->limit(system_, t, y, false);
  IDASetStopTime(memory_, std::min(stop(), ahead_));
}

bool IdaSession::was_too_long(double t) const {
  if (!plan_ || t != ahead_of_) return false;
  double h = 0;
  IDAGetLastStep(memory_, &h);
  return h > kLongAgainstNext * (ahead_ - t);
}

void IdaSession::enable_cost() {
  if (!system_.has_running_cost()) return;
  q_ = Vector(1, context_);
  q_.data()[0] = start_.cost;
  check(IDAQuadInit(memory_, quadrature, q_), "IDAQuadInit");
  check(IDAQuadSStolerances(memory_, options_.rtol, options_.absolute() * cost_size(system_)), "IDAQuadSStolerances");
  check(IDASetQuadErrCon(memory_, SUNTRUE), "IDASetQuadErrCon");
}

void IdaSession::enable_sensitivities() {
  const int n = system_.size(), np = system_.parameter_count();
  if (np == 0) return;
  yS_ = VectorArray(np, n, context_);
  ypS_ = VectorArray(np, n, context_);
  std::vector<N_Vector> atol;
  for (int j = 0; j < np; ++j) {
    if (start_.s.empty()) {
      std::copy(y_rho_.col(j).data(), y_rho_.col(j).data() + n, yS_.data(j));
      std::copy(yp_rho_.col(j).data(), yp_rho_.col(j).data() + n, ypS_.data(j));
    } else {
      std::copy(start_.s[j].begin(), start_.s[j].end(), yS_.data(j));
      std::copy(start_.sp[j].begin(), start_.sp[j].end(), ypS_.data(j));
    }
    atol_S_.push_back(absolute_tolerances(options_.absolute() / system_.parameters().parameters[j].scale));
    atol.push_back(atol_S_.back());
  }
  check(IDASensInit(memory_, np, options_.staggered ? IDA_STAGGERED : IDA_SIMULTANEOUS, sensitivity_residual,
                    yS_.handles(), ypS_.handles()),
        "IDASensInit");
  check(IDASensSVtolerances(memory_, options_.rtol, atol.data()), "IDASensSVtolerances");
  check(IDASetSensErrCon(memory_, SUNTRUE), "IDASetSensErrCon");
  if (!system_.has_running_cost()) return;
  qS_ = VectorArray(np, 1, context_);
  for (std::size_t j = 0; j < start_.cost_gradient.size(); ++j)
    qS_.data(static_cast<int>(j))[0] = start_.cost_gradient[j];
  std::vector<double> atol_q;
  for (int j = 0; j < np; ++j)
    atol_q.push_back(options_.absolute() * cost_size(system_) / system_.parameters().parameters[j].scale);
  check(IDAQuadSensInit(memory_, sensitivity_quadrature, qS_.handles()), "IDAQuadSensInit");
  check(IDAQuadSensSStolerances(memory_, options_.rtol, atol_q.data()), "IDAQuadSensSStolerances");
  check(IDASetQuadSensErrCon(memory_, SUNTRUE), "IDASetQuadSensErrCon");
}

void IdaSession::enable_adjoint(const CheckpointPlan& plan) {
  adjoint_ = true;
  watch_.emplace(system_, plan);
  check(IDAAdjInit(memory_, plan.steps, IDA_POLYNOMIAL), "IDAAdjInit");
  // IDAS restarts the quadratures wrongly when it repeats the first segment (corrected in 2026, llnl/sundials#888), so
  // that under error control its steps may differ from the original's.
  if (plan.repeats && system_.has_running_cost()) check(IDASetQuadErrCon(memory_, SUNFALSE), "IDASetQuadErrCon");
}

void IdaSession::advance(double t) {
  if (t <= t_) return;
  double reached = t_;
  const int flag = IDASolve(memory_, t, &reached, y_, yp_, IDA_NORMAL);
  if (flag < 0) fail(memory_, flag, "IDAS could not continue the simulation", system_.unknowns());
  t_ = reached;
  if (t_ >= options_.t_end) solve_algebraic(system_, t_, y_.data());
}

void IdaSession::record_step(double begin, double end, Trajectory& trajectory) {
  int order = 0;
  IDAGetLastOrder(memory_, &order);
  Vector at(system_.size(), context_);
  if (!system_.begins_with_motion()) {
    trajectory.add_step(begin, end, order, [&](double t) {
      check(IDAGetDky(memory_, t, 0, at), "IDAGetDky");
      return system_.kinematic_state(t, at.data());
    });
    return;
  }
  std::vector<std::vector<double>> d(static_cast<std::size_t>(order) + 1);
  for (int k = 0; k <= order; ++k) {
    check(IDAGetDky(memory_, end, k, at), "IDAGetDky");
    d[static_cast<std::size_t>(k)].assign(at.data(), at.data() + trajectory.width());
  }
  trajectory.add_step(begin, end, d, order);
}

void IdaSession::advance_with_checkpoints(double t) {
  int checkpoints = 0;
  double reached = t_;
  const int flag = IDASolveF(memory_, t, &reached, y_, yp_, IDA_NORMAL, &checkpoints);
  if (flag < 0) fail(memory_, flag, "IDAS could not continue the simulation", system_.unknowns());
  t_ = reached;
  if (t_ >= options_.t_end) solve_algebraic(system_, t_, y_.data());
  counters_.checkpoints = checkpoints;
}

bool IdaSession::advance_segment(double t, Trajectory* trajectory, const StepSink& after_step) {
  const double known = step_end_;  // y_ may hold an earlier time of the step that ends there
  const auto interpolate = [&](double at) {
    check(IDAGetDky(memory_, at, 0, y_), "IDAGetDky");
    check(IDAGetDky(memory_, at, 1, yp_), "IDAGetDky");
    t_ = at;
  };
  while (step_end_ < t) {
    if (ended_) {
      interpolate(step_end_);
      return false;
    }
    limit_steps();
    int checkpoints = 0;
    const double begin = step_end_;
    // What the repetitions begin with is the end of all; the next step is bounded already.
    if (plan_ && adjoint_) IDASetStopTime(memory_, stop());
    const int flag = adjoint_ ? IDASolveF(memory_, options_.t_end, &step_end_, y_, yp_, IDA_ONE_STEP, &checkpoints)
                              : IDASolve(memory_, options_.t_end, &step_end_, y_, yp_, IDA_ONE_STEP);
    if (flag < 0) fail(memory_, flag, "IDAS could not continue the simulation", system_.unknowns());
    if (adjoint_) counters_.checkpoints = checkpoints;
    const auto event = system_.find_event(begin, step_end_, [&](double at) {
      check(IDAGetDky(memory_, at, 0, y_), "IDAGetDky");
      return y();
    });
    if (event) step_end_ = *event;
    if (system_.has_events()) interpolate(step_end_);
    ended_ = event || system_.segment_ends(step_end_, y());
    restart_ = !ended_ && step_end_ < options_.t_end && was_too_long(step_end_);
    ended_ = ended_ || restart_;
    if (trajectory) record_step(begin, step_end_, *trajectory);
    // Last: it may throw, and the run be gone on with.
    if (after_step) after_step(step_end_, y());
  }
  if (t < step_end_ || (t_ < t && t == known)) interpolate(t);
  t_ = t;
  if (t_ >= options_.t_end) solve_algebraic(system_, t_, y_.data());
  return true;
}

void IdaSession::jump(Jump& jump, SegmentStart& start) {
  const int n = system_.size();
  jump.t = t_;
  IDAGetNumSteps(memory_, &start.steps);
  start.steps += start_.steps;
  start.restart = restart_;
  jump.event = restart_ ? -1 : system_.pending_event();
  start.t = restart_ ? t_ : system_.segment_start(t_);
  jump.before = system_.mode();
  jump.y.assign(y(), y() + n);
  jump.yp.assign(yp(), yp() + n);
  start.y = jump.y;
  start.yp = jump.yp;
  if (!restart_) system_.jump(t_, start.y.data(), start.yp.data());
  jump.after = system_.mode();
  start.cost = cost();
  if (!restart_) system_.forget_event();
  if (yS_.count() == 0) return;
  check(IDAGetSensDky(memory_, t_, 0, yS_.handles()), "IDAGetSensDky");
  if (restart_) check(IDAGetSensDky(memory_, t_, 1, ypS_.handles()), "IDAGetSensDky");
  std::vector<double*> columns, rates;
  start.s.resize(static_cast<std::size_t>(yS_.count()));
  start.sp.resize(start.s.size(), std::vector<double>(static_cast<std::size_t>(n), 0));
  for (int j = 0; j < yS_.count(); ++j) {
    start.s[j].assign(yS_.data(j), yS_.data(j) + n);
    if (restart_) start.sp[j].assign(ypS_.data(j), ypS_.data(j) + n);
    columns.push_back(start.s[j].data());
    rates.push_back(start.sp[j].data());
  }
  if (!restart_) system_.jump_tangent(jump, columns.data(), rates.data(), yS_.count());
  if (qS_.count() == 0) return;
  check(IDAGetQuadSensDky(memory_, t_, 0, qS_.handles()), "IDAGetQuadSensDky");
  for (int j = 0; j < qS_.count(); ++j) {
    const auto k = static_cast<std::size_t>(j);
    const double gained = !restart_ && k < system_.jump_cost_tangent().size() ? system_.jump_cost_tangent()[k] : 0;
    start.cost_gradient.push_back(qS_.data(j)[0] + gained);
  }
}

double IdaSession::cost() {
  if (!system_.has_running_cost()) return 0;
  check(IDAGetQuadDky(memory_, t_, 0, q_), "IDAGetQuadDky");
  return q_.data()[0];
}

std::vector<double> IdaSession::sensitivity_gradient() {
  const int n = system_.size(), np = system_.parameter_count();
  std::vector<double> gradient(static_cast<std::size_t>(np), 0);
  if (np == 0) return gradient;
  if (system_.has_running_cost()) {
    check(IDAGetQuadSensDky(memory_, t_, 0, qS_.handles()), "IDAGetQuadSensDky");
    for (int j = 0; j < np; ++j) gradient[j] = qS_.data(j)[0];
  }
  if (!system_.objective().terminal.empty()) {
    check(IDAGetSensDky(memory_, t_, 0, yS_.handles()), "IDAGetSensDky");
    system_.terminal_cost_gradient(t_, y(), g_y_.data(), 1, gradient.data());
    for (int j = 0; j < np; ++j)
      for (int i = 0; i < n; ++i) gradient[j] += g_y_[i] * yS_.data(j)[i];
  }
  return gradient;
}

void IdaSession::read_forward_counters() {
  Counters& c = counters_;
  IDAGetNumSteps(memory_, &c.steps);
  IDAGetNumResEvals(memory_, &c.residuals);
  IDAGetNumJacEvals(memory_, &c.jacobians);
  IDAGetNumNonlinSolvIters(memory_, &c.newton_iterations);
  IDAGetNumErrTestFails(memory_, &c.error_test_failures);
  IDAGetNumNonlinSolvConvFails(memory_, &c.convergence_failures);
  if (yS_.count() > 0) IDAGetSensNumResEvals(memory_, &c.sensitivity_residuals);
  c.factorizations = system_.factorizations();
  c.position_iterations = system_.position_iterations();
  c.simulations = 1;
}

int IdaSession::residual(double t, N_Vector y, N_Vector yp, N_Vector r, void* p) {
  IdaSession& s = self_of(p);
  return s.guard_.run([&] {
    s.poll(t, false);
    s.watch_forward();
    s.system_.residual(t, data(y), data(yp), data(r));
    s.look_ahead(t, data(y));
  });
}

int IdaSession::jacobian(double t, double cj, N_Vector y, N_Vector yp, N_Vector, SUNMatrix, void* p, N_Vector, N_Vector,
                         N_Vector) {
  IdaSession& s = self_of(p);
  return s.guard_.run([&] {
    s.watch_forward();
    s.system_.factor(t, data(y), data(yp), cj);
  });
}

int IdaSession::quadrature(double t, N_Vector y, N_Vector, N_Vector q, void* p) {
  IdaSession& s = self_of(p);
  return s.guard_.run([&] {
    s.watch_forward();
    const double* x = cost_state(s.system_, t, data(y));
    data(q)[0] = s.system_.running_cost(t, x);
    if (!s.adjoint_ || s.scale_samples_++ % 8 != 0) return;
    s.system_.running_cost_gradient(t, x, s.g_y_.data(), 0, nullptr);
    s.adjoint_scale_.sample(x, s.g_y_, s.system_.unknowns());
  });
}

int IdaSession::sensitivity_residual(int count, double t, N_Vector y, N_Vector yp, N_Vector, N_Vector* yS,
                                     N_Vector* ypS, N_Vector* rS, void* p, N_Vector, N_Vector, N_Vector) {
  IdaSession& s = self_of(p);
  return s.guard_.run([&] {
    s.system_.linearize(t, data(y), data(yp));
    s.system_.parameter_columns(s.F_rho_);
    const int n = s.system_.size();
    for (int j = 0; j < count; ++j) {
      double* r = data(rS[j]);
      const double *x = data(yS[j]), *xp = data(ypS[j]), *id = s.id_.data();
      for (int i = 0; i < n; ++i) r[i] = id[i] * xp[i] + s.F_rho_(i, j);
      s.system_.add_product(1, x, r);
    }
  });
}

int IdaSession::sensitivity_quadrature(int count, double t, N_Vector y, N_Vector, N_Vector* yS, N_Vector*, N_Vector,
                                       N_Vector* qS, void* p, N_Vector, N_Vector, N_Vector) {
  IdaSession& s = self_of(p);
  return s.guard_.run([&] {
    const int n = s.system_.size();
    double* g_rho = s.q_rho_buffer(count);
    s.system_.running_cost_gradient(t, cost_state(s.system_, t, data(y)), s.g_y_.data(), 1, g_rho);
    for (int j = 0; j < count; ++j) {
      double sum = g_rho[j];
      const double* x = data(yS[j]);
      for (int i = 0; i < n; ++i) sum += s.g_y_[i] * x[i];
      data(qS[j])[0] = sum;
    }
  });
}

}  // namespace costate
