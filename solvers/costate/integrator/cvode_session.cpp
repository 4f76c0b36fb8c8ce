#include "costate/integrator/cvode_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/event/motion_events.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/sundials/failure.h"
#include "costate/sundials/finite_values.h"

namespace costate {

CvodeSession::CvodeSession(OdeSystem& system, const SolverOptions& options, Monitor monitor, StartDerivative wanted,
                           Cost cost)
    : SundialsSession(system, options, std::move(monitor), options.t_start),
      cost_state_(cost == Cost::state && system.has_running_cost()) {
  y_ = Vector(system.size() + (cost_state_ ? 1 : 0), context_);
  const bool derivative = system.parameter_count() > 0 && needs_start_columns(system.assembly(), wanted);
  system.start(options.t_start, y_.data(), derivative ? &y_rho_ : nullptr);
  create_memory();
}

CvodeSession::CvodeSession(OdeSystem& system, const SolverOptions& options, Monitor monitor, const SegmentStart& start,
                           Cost cost)
    : SundialsSession(system, options, std::move(monitor), start.t),
      cost_state_(cost == Cost::state && system.has_running_cost()) {
  start_ = start;
  y_ = Vector(static_cast<int>(start.y.size()), context_);
  std::copy(start.y.begin(), start.y.end(), y_.data());
  create_memory();
}

void CvodeSession::create_memory() {
  g_y_.assign(static_cast<std::size_t>(system_.size()), 0);
  open(CVodeCreate(linear_multistep(), context_));
  check(CVodeInit(memory_, rhs, t_, y_), "the start");
  Vector atol(y_.size(), context_);  // SUNDIALS copies it
  fill_absolute_tolerances(system_, options_, y_.size(), atol.data());
  check(CVodeSVtolerances(memory_, options_.rtol, atol), "the tolerances");
  set_up();
  check(CVodeSetLinSysFn(memory_, newton_matrix), "Newton's matrix");
}

int CvodeSession::linear_multistep() const { return options_.cvodes_method == "adams" ? CV_ADAMS : CV_BDF; }

void CvodeSession::choose_smooth_steps(void* memory) {
  if (linear_multistep() != CV_ADAMS) return;
  // CVODES keeps step and order until another step is 1.5 times as long. One more order seldom makes it that: runs were
  // held at order 5 or 7, by chance of their first steps, and car_axis took twice the steps at rtol 1e-10 that it took
  // at 1e-9, with larger errors. Beyond order 9 the regions of stability are so small (|h lambda| < 0.3) that error
  // tests fail for that. Over bends of forces low orders do better.
  constexpr double kLongerStep = 1.2;
  constexpr int kHighestOrder = 9;
  check(CVodeSetEtaFixedStepBounds(memory, 0, kLongerStep), "the choice of steps");
  check(CVodeSetMaxOrd(memory, kHighestOrder), "the highest order");
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

void CvodeSession::watch_stiffness(StiffnessWatch& watch, void* memory, double t, const double* y, double end) {
  if (linear_multistep() != CV_ADAMS) return;
  const long taken = steps(memory);
  if (!watch.due(taken)) return;
  double h = 0;
  int q = 0;
  CVodeGetLastStep(memory, &h);
  CVodeGetLastOrder(memory, &q);
  const double left = std::abs(end - t);
  h = std::abs(h);
  // Steps that may as well be taken: BDF begins anew, and where it is not bound by stability takes some thousands. A
  // touch is stiff for as long as it lasts.
  const double few = MotionEvents::has_any(system_.assembly().mechanism()) ? 2e5 : 2e4;
  if (!(left > few * h)) return;
  const double rate = watch.bound_by(system_, t, y, h, q);
  if (!(rate > 0)) return;
  throw StiffError(
      fmt::format("The {} is stiff at t = {:.6g} s: after {} steps Adams' method still takes steps of {:.3g} "
                  "s, the size at which it is stable, for a rate of {:.3g} 1/s (a light mass, a stiff damper or "
                  "spring); about {:.2g} more would follow. Take CVODES's BDF (--cvodes-method bdf) or a "
                  "formulation on IDAS.",
                  memory == memory_ ? "motion" : "motion's adjoint", t, taken, h, rate, left / h));
}

void CvodeSession::enable_sensitivities() {
  const int n = system_.size(), np = system_.parameter_count();
  if (np == 0) return;
  yS_ = VectorArray(np, y_.size(), context_);
  VectorArray atol(np, y_.size(), context_);
  for (int j = 0; j < np; ++j) {
    if (start_.s.empty())
      std::copy(y_rho_.col(j).data(), y_rho_.col(j).data() + n, yS_.data(j));
    else
      std::copy(start_.s[j].begin(), start_.s[j].end(), yS_.data(j));
    fill_absolute_tolerances(system_, options_, y_.size(), atol.data(j), system_.parameters().parameters[j].scale);
  }
  columns_in_.resize(static_cast<std::size_t>(np));
  columns_out_.resize(static_cast<std::size_t>(np));
  g_rho_.resize(static_cast<std::size_t>(np));
  check(CVodeSensInit(memory_, np, options_.staggered ? CV_STAGGERED : CV_SIMULTANEOUS, sensitivity_rhs, yS_.handles()),
        "sensitivities");
  check(CVodeSensSVtolerances(memory_, options_.rtol, atol.handles()), "the sensitivities' tolerances");
  check(CVodeSetSensErrCon(memory_, SUNTRUE), "the sensitivities' error control");
}

void CvodeSession::jump_sensitivities(const Jump& jump, SegmentStart& start) {
  if (restart_) return;
  std::vector<double*> columns;
  for (auto& s : start.s) columns.push_back(s.data());
  system_.jump_tangent(jump, columns.data(), yS_.count());
  if (cost_state_)
    for (std::size_t j = 0; j < system_.jump_cost_tangent().size(); ++j)
      start.s[j][static_cast<std::size_t>(system_.size())] += system_.jump_cost_tangent()[j];
}

std::vector<double> CvodeSession::sensitivity_gradient() {
  const int np = system_.parameter_count();
  std::vector<double> gradient(static_cast<std::size_t>(np), 0);
  if (np == 0) return gradient;
  gradient = terminal_gradient();
  if (cost_state_) {
    if (steps(memory_) > 0) check(CVodeGetSensDky(memory_, t_, 0, yS_.handles()), "sensitivities");
    for (int j = 0; j < np; ++j) gradient[j] += yS_.data(j)[system_.size()];
  }
  return gradient;
}

std::vector<double> CvodeSession::terminal_gradient() {
  const int np = system_.parameter_count();
  std::vector<double> gradient(static_cast<std::size_t>(np), 0);
  if (np == 0 || system_.objective().terminal.empty()) return gradient;
  // Before the first step they are those of the start.
  if (steps(memory_) > 0) check(CVodeGetSensDky(memory_, t_, 0, yS_.handles()), "sensitivities");
  for (int j = 0; j < np; ++j) columns_in_[j] = yS_.data(j);
  system_.tangent_terminal_cost(t_, y(), columns_in_.data(), gradient.data(), np);
  return gradient;
}

int CvodeSession::rhs(double t, N_Vector y, N_Vector f, void* p) {
  CvodeSession& s = self_of(p);
  return s.guard_.run([&] {
    s.poll(t, false);
    s.watch_forward();
    require_trial_state(s.system_, t, data(y));
    s.system_.rhs(t, data(y), data(f));
    require_values(s.system_, t, data(y), data(f));
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
    data(q)[0] = s.running_cost(t, data(y));
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
