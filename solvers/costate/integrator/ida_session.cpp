#include "costate/integrator/ida_session.h"

#include <algorithm>
#include <cmath>

#include "costate/integrator/error_weights.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/sundials/finite_values.h"

namespace costate {

namespace {
// Newton's iterations end with an error of so much of the tolerance. Accelerations in their norm see to it that this is
// enough; without them (and with hidden constraints, where a step's error is divided by its length in the algebraic
// unknowns) it comes back in the error test: at IDAS's own 0.33 the five-bar by index2 takes half as many steps again
// as at 0.01, and a mass on a stiff spring ten times as many.
constexpr double kNewtonOfStates = 0.01;
}  // namespace

bool IdaSession::iterates_on_accelerations() const {
  const auto& unknowns = system_.unknowns();
  return std::any_of(unknowns.begin(), unknowns.end(),
                     [](const Unknown& u) { return u.role == Unknown::Role::acceleration && u.in_norm; });
}

bool IdaSession::some_outside_norm() const {
  const auto& unknowns = system_.unknowns();
  return std::any_of(unknowns.begin(), unknowns.end(), [](const Unknown& u) { return !u.in_norm; });
}

const double* IdaSession::cost_state(double t, const double* y) {
  if (!system_.objective().running_needs_accelerations()) return y;
  solved_cost_.forget();
  return solved_cost_.at(system_, t, y);
}

IdaSession::IdaSession(DaeSystem& system, const SolverOptions& options, Monitor monitor, StartDerivative wanted)
    : SundialsSession(system, options, std::move(monitor), options.t_start) {
  y_ = Vector(system.size(), context_);
  yp_ = Vector(system.size(), context_);
  const bool derivative = system.parameter_count() > 0 && needs_start_columns(system.assembly(), wanted);
  system.start(options.t_start, y_.data(), yp_.data(), derivative ? &y_rho_ : nullptr, derivative ? &yp_rho_ : nullptr);
  create_memory();
}

IdaSession::IdaSession(DaeSystem& system, const SolverOptions& options, Monitor monitor, const SegmentStart& start)
    : SundialsSession(system, options, std::move(monitor), start.t) {
  start_ = start;
  const int size = system.size() + (start.led ? 1 : 0);
  y_ = Vector(size, context_);
  yp_ = Vector(size, context_);
  std::copy(start.y.begin(), start.y.end(), y_.data());
  std::copy(start.yp.begin(), start.yp.end(), yp_.data());
  if (led() > 0) begin_lead();
  create_memory();
}

void IdaSession::create_memory() {
  const int n = system_.size();
  id_ = Vector(y_.size(), context_);
  g_y_.assign(static_cast<std::size_t>(n), 0);
  bool algebraic = false;
  for (int i = 0; i < n; ++i) {
    id_.data()[i] = system_.unknowns()[i].differential ? 1 : 0;
    algebraic = algebraic || !system_.unknowns()[i].differential;
  }
  if (led() > 0) id_.data()[n] = 1;
  atol_ = absolute_tolerances(options_.absolute());
  open(IDACreate(context_));
  check(IDAInit(memory_, residual, t_, y_, yp_), "the start");
  check(IDAWFtolerances(memory_,
                        [](N_Vector y, N_Vector w, void* p) {
                          IdaSession& s = self_of(p);
                          double h = 0;
                          // Before the first step it is what another run has left.
                          if (s.steps(s.memory_) > 0) IDAGetCurrentStep(s.memory_, &h);
                          const double* x = costate::data(y);
                          if (s.led() > 0) costate::data(w)[s.system_.size()] = 1;
                          return set_error_weights(s.system_.unknowns(), x, s.options_.rtol, s.atol_.data(), h,
                                                   costate::data(w));
                        }),
        "the tolerances");
  check(IDASetId(memory_, id_), "the algebraic unknowns");
  if (algebraic) check(IDASetSuppressAlg(memory_, SUNTRUE), "the algebraic unknowns");
  set_up();
  check(IDASetJacFn(memory_, jacobian), "the Jacobian");
  check(IDASetLinearSolutionScaling(memory_, SUNFALSE), "Newton's operator");
  if (!iterates_on_accelerations()) check(IDASetNonlinConvCoef(memory_, kNewtonOfStates), "Newton's tolerance");
  iterations_.emplace(y_, 0, context_, newton_setups_, some_outside_norm());
  check(iterations_->attach([&](SUNNonlinearSolver s) { return IDASetNonlinearSolver(memory_, s); }),
        "Newton's method");
}

Vector IdaSession::absolute_tolerances(double scale) const {
  Vector v(y_.size(), context_);
  const auto sizes = unknown_sizes(system_);
  for (std::size_t i = 0; i < sizes.size(); ++i)
    v.data()[i] = system_.unknowns()[i].in_norm ? scale * sizes[i] : kUnweighted;
  if (led() > 0) v.data()[system_.size()] = 1;
  return v;
}

void IdaSession::enable_sensitivities() {
  const int n = system_.size(), np = system_.parameter_count();
  if (np == 0) return;
  yS_ = VectorArray(np, y_.size(), context_);
  ypS_ = VectorArray(np, y_.size(), context_);
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
        "sensitivities");
  iterations_S_.emplace(y_, options_.staggered ? np : np + 1, context_, newton_setups_, some_outside_norm());
  check(iterations_S_->attach([&](SUNNonlinearSolver s) {
    return options_.staggered ? IDASetNonlinearSolverSensStg(memory_, s) : IDASetNonlinearSolverSensSim(memory_, s);
  }),
        "Newton's method of sensitivities");
  check(IDASensSVtolerances(memory_, options_.rtol, atol.data()), "the sensitivities' tolerances");
  check(IDASetSensErrCon(memory_, SUNTRUE), "the sensitivities' error control");
  if (!system_.has_running_cost()) return;
  qS_ = VectorArray(np, 1, context_);
  for (std::size_t j = 0; j < start_.cost_gradient.size(); ++j)
    qS_.data(static_cast<int>(j))[0] = start_.cost_gradient[j];
  std::vector<double> atol_q;
  for (int j = 0; j < np; ++j)
    atol_q.push_back(cost_tolerance(system_, options_) / system_.parameters().parameters[j].scale);
  check(IDAQuadSensInit(memory_, sensitivity_quadrature, qS_.handles()), "psi's sensitivities");
  check(IDAQuadSensSStolerances(memory_, options_.rtol, atol_q.data()), "the tolerances of psi's sensitivities");
  check(IDASetQuadSensErrCon(memory_, SUNTRUE), "the error control of psi's sensitivities");
}

void IdaSession::jump_sensitivities(const Jump& jump, SegmentStart& start) {
  const int n = system_.size();
  if (restart_) check(IDAGetSensDky(memory_, t_, 1, ypS_.handles()), "sensitivities");
  std::vector<double*> columns, rates;
  start.sp.resize(start.s.size(), std::vector<double>(static_cast<std::size_t>(n), 0));
  for (int j = 0; j < yS_.count(); ++j) {
    const auto k = static_cast<std::size_t>(j);
    if (restart_) start.sp[k].assign(ypS_.data(j), ypS_.data(j) + n);
    columns.push_back(start.s[k].data());
    rates.push_back(start.sp[k].data());
  }
  if (!restart_) system_.jump_tangent(jump, columns.data(), rates.data(), yS_.count());
  if (qS_.count() == 0) return;
  check(IDAGetQuadSensDky(memory_, within_last_step(memory_, t_), 0, qS_.handles()), "psi's sensitivities");
  for (int j = 0; j < qS_.count(); ++j) {
    const auto k = static_cast<std::size_t>(j);
    const double gained = !restart_ && k < system_.jump_cost_tangent().size() ? system_.jump_cost_tangent()[k] : 0;
    start.cost_gradient.push_back(qS_.data(j)[0] + gained);
  }
}

std::vector<double> IdaSession::sensitivity_gradient() {
  const int np = system_.parameter_count();
  std::vector<double> gradient(static_cast<std::size_t>(np), 0);
  if (np == 0) return gradient;
  if (system_.has_running_cost()) {
    if (steps(memory_) > 0)
      check(IDAGetQuadSensDky(memory_, within_last_step(memory_, t_), 0, qS_.handles()), "psi's sensitivities");
    for (int j = 0; j < np; ++j) gradient[j] = qS_.data(j)[0];
  }
  const std::vector<double> terminal = terminal_gradient();
  for (int j = 0; j < np; ++j) gradient[j] += terminal[j];
  return gradient;
}

std::vector<double> IdaSession::terminal_gradient() {
  const int n = system_.size(), np = system_.parameter_count();
  std::vector<double> gradient(static_cast<std::size_t>(np), 0);
  if (np == 0 || system_.objective().terminal.empty()) return gradient;
  // Before the first step they are those of the start.
  if (steps(memory_) > 0) check(IDAGetSensDky(memory_, t_, 0, yS_.handles()), "sensitivities");
  system_.terminal_cost_gradient(t_, y(), g_y_.data(), 1, gradient.data());
  for (int j = 0; j < np; ++j)
    for (int i = 0; i < n; ++i) gradient[j] += g_y_[i] * yS_.data(j)[i];
  return gradient;
}

// IDAS scales the whole correction by 2 / (1 + cj / cj of the factors), between that where rates decide and that where
// they do not. But algebraic equations hold no rates: scaled, their unknowns keep a part of their predicted error, up
// to a quarter, which the next step's extrapolation makes up to thirty times larger; they are in no norm, so that
// nothing ended that until the residual was all rounding, and the differential unknowns followed their predictions. So
// what is scaled is the residual of the differential equations: the algebraic ones are met in any case.
void IdaSession::scale_newton(void* memory, double cj, const Vector& id, double* b) {
  double now = cj;
  IDAGetCurrentCj(memory, &now);
  if (now == cj) return;
  const double scale = 2 / (1 + now / cj);
  for (int i = 0; i < id.size(); ++i)
    if (id.data()[i] != 0) b[i] *= scale;
}

int IdaSession::residual(double t, N_Vector y, N_Vector yp, N_Vector r, void* p) {
  IdaSession& s = self_of(p);
  return s.guard_.run([&] {
    s.poll(t, false);
    s.watch_forward();
    require_trial_state(s.system_, t, data(y));
    s.system_.residual(t, data(y), data(yp), data(r));
    require_values(s.system_, t, data(y), data(r));
    if (const int last = s.system_.size(); s.led() > 0) data(r)[last] = data(yp)[last] - s.clock_rate(t);
    s.look_ahead(t, data(y));
  });
}

int IdaSession::jacobian(double t, double cj, N_Vector y, N_Vector yp, N_Vector, SUNMatrix, void* p, N_Vector, N_Vector,
                         N_Vector) {
  IdaSession& s = self_of(p);
  ++s.newton_setups_;
  return s.guard_.run([&] {
    s.watch_forward();
    s.system_.factor(t, data(y), data(yp), cj);
    s.cj_ = cj;
  });
}

int IdaSession::quadrature(double t, N_Vector y, N_Vector, N_Vector q, void* p) {
  IdaSession& s = self_of(p);
  return s.guard_.run([&] {
    s.watch_forward();
    data(q)[0] = s.running_cost(t, s.cost_state(t, data(y)));
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
      if (s.led() > 0) r[n] = xp[n];
    }
  });
}

int IdaSession::sensitivity_quadrature(int count, double t, N_Vector y, N_Vector, N_Vector* yS, N_Vector*, N_Vector,
                                       N_Vector* qS, void* p, N_Vector, N_Vector, N_Vector) {
  IdaSession& s = self_of(p);
  return s.guard_.run([&] {
    const int n = s.system_.size();
    s.g_rho_.assign(static_cast<std::size_t>(count), 0.0);
    s.system_.running_cost_gradient(t, s.cost_state(t, data(y)), s.g_y_.data(), 1, s.g_rho_.data());
    for (int j = 0; j < count; ++j) {
      double sum = s.g_rho_[static_cast<std::size_t>(j)];
      const double* x = data(yS[j]);
      for (int i = 0; i < n; ++i) sum += s.g_y_[i] * x[i];
      data(qS[j])[0] = sum;
    }
  });
}

}  // namespace costate
