// The backward half of IdaSession: the adjoint problem, segment by segment.
#include <idas/idas.h>

#include <algorithm>
#include <cmath>

#include "costate/integrator/ida_session.h"
#include "costate/integrator/solved_algebraic.h"
#include "costate/sundials/failure.h"
#include "costate/sundials/message_capture.h"

namespace costate {

namespace {
/// Of the backward run that the thread is at: its forward states as its equations take them.
thread_local SolvedAlgebraic solved;
}  // namespace

std::vector<double> IdaSession::solve_adjoint() {
  std::vector<double> gradient(static_cast<std::size_t>(system_.parameter_count()), 0);
  AdjointState mu = end_adjoint(gradient);
  solve_backward(mu, adjoint_scale_.size(t_ - options_.t_start), gradient);
  add_start_gradient(mu, gradient);
  return gradient;
}

AdjointState IdaSession::end_adjoint(std::vector<double>& gradient) {
  AdjointState mu;
  mu.mu.assign(static_cast<std::size_t>(system_.size()), 0);
  mu.mup = mu.mu;
  system_.terminal_adjoint(t_, y(), yp(), mu.mu.data(), mu.mup.data(), gradient.data());
  return mu;
}

void IdaSession::transfer_adjoint(DaeSystem& system, const Jump& jump, AdjointState& mu,
                                  std::vector<double>& gradient) {
  system.jump_adjoint(jump, mu.mu.data(), mu.mup.data(), gradient.data());
}

void IdaSession::add_start_gradient(const AdjointState& mu, std::vector<double>& gradient) const {
  // mu(0)^T F_y' y_rho(0)
  for (int j = 0; j < system_.parameter_count(); ++j)
    for (int i = 0; i < system_.size(); ++i)
      if (id_.data()[i] != 0) gradient[j] += mu.mu[i] * y_rho_(i, j);
}

void IdaSession::solve_backward(AdjointState& mu, const AdjointSize& expected, std::vector<double>& gradient) {
  const int n = system_.size(), np = system_.parameter_count();
  solved.forget();
  backward_ = std::make_unique<Backward>();
  Backward& b = *backward_;
  const int size = n + summed_back();
  b.y = Vector(size, context_);
  b.yp = Vector(size, context_);
  b.q = Vector(np, context_);
  b.atol_q = Vector(np, context_);
  b.g_y.assign(static_cast<std::size_t>(n), 0);
  b.g_rho.assign(static_cast<std::size_t>(np), 0);
  std::copy(mu.mu.begin(), mu.mu.end(), b.y.data());
  std::copy(mu.mup.begin(), mu.mup.end(), b.yp.data());
  b.atol = Vector(size, context_);
  const double scale =
      set_adjoint_tolerances(system_.unknowns(), mu.mu, expected, options_.rtol, kUnweighted, b.atol.data());
  set_gradient_tolerances(system_, y(), scale, options_.rtol, b.atol_q.data());
  b.id = Vector(size, context_);
  std::copy(id_.data(), id_.data() + n, b.id.data());
  if (summed_back() > 0) begin_sum();

  check(IDACreateB(memory_, &b.which), "IDACreateB");
  check(IDAInitB(memory_, b.which, backward_residual, t_, b.y, b.yp), "IDAInitB");
  check(IDASetUserDataB(memory_, b.which, this), "IDASetUserDataB");
  check(IDASVtolerancesB(memory_, b.which, options_.rtol, b.atol), "IDASVtolerancesB");
  check(IDASetMaxNumStepsB(memory_, b.which, options_.max_steps), "IDASetMaxNumStepsB");
  if (options_.max_step_s > 0) check(IDASetMaxStepB(memory_, b.which, options_.max_step_s), "IDASetMaxStepB");
  check(IDASetIdB(memory_, b.which, b.id), "IDASetIdB");
  check(IDASetSuppressAlgB(memory_, b.which, SUNTRUE), "IDASetSuppressAlgB");
  // J_B = cj E - F_y^T = -(F_y - cj E)^T: the forward Newton matrix at -cj, solved transposed.
  b.newton = std::make_unique<NewtonOperator>(context_, guard_, [this](double* x) {
    system_.solve_transposed(x);
    for (int i = 0; i < system_.size(); ++i) x[i] = -x[i];
    if (summed_back() > 0) solve_sum(x);
  });
  check(IDASetLinearSolverB(memory_, b.which, b.newton->solver(), b.newton->matrix()), "IDASetLinearSolverB");
  check(IDASetJacFnB(memory_, b.which, backward_jacobian), "IDASetJacFnB");
  void* memory_b = IDAGetAdjIDABmem(memory_, b.which);
  if (np > 0) {
    check(IDAQuadInitB(memory_, b.which, backward_quadrature, b.q), "IDAQuadInitB");
    check(IDAQuadSVtolerancesB(memory_, b.which, options_.rtol, b.atol_q), "IDAQuadSVtolerancesB");
    check(IDASetQuadErrConB(memory_, b.which, SUNTRUE), "IDASetQuadErrConB");
  }
  read_checkpoints();
  capture_ida_messages(memory_b, message_);
  const int flag = IDASolveB(memory_, options_.t_start, IDA_NORMAL);
  if (flag < 0) fail(memory_b, flag, "IDAS could not continue the backward (adjoint) run", names_back());
  double reached = 0;
  check(IDAGetB(memory_, b.which, &reached, b.y, b.yp), "IDAGetB");
  if (np > 0) {
    check(IDAGetQuadB(memory_, b.which, &reached, b.q), "IDAGetQuadB");
    for (int j = 0; j < np; ++j) gradient[j] += b.q.data()[j];
  }
  std::copy(b.y.data(), b.y.data() + n, mu.mu.begin());
  std::copy(b.yp.data(), b.yp.data() + n, mu.mup.begin());
  Counters& c = counters_;
  IDAGetNumSteps(memory_b, &c.backward_steps);
  IDAGetNumResEvals(memory_b, &c.backward_residuals);
  IDAGetNumJacEvals(memory_b, &c.backward_jacobians);
  IDAGetNumNonlinSolvIters(memory_b, &c.backward_newton_iterations);
  IDAGetNumErrTestFails(memory_b, &c.backward_error_test_failures);
  IDAGetNumNonlinSolvConvFails(memory_b, &c.backward_convergence_failures);
  c.factorizations = system_.factorizations();
  c.position_iterations = system_.position_iterations();
}

void IdaSession::read_checkpoints() {
  checkpoint_times_.clear();
  if (!plan_) return;
  std::vector<IDAadjCheckPointRec> records(static_cast<std::size_t>(counters_.checkpoints) + 1);
  check(IDAGetAdjCheckPointsInfo(memory_, records.data()), "IDAGetAdjCheckPointsInfo");
  for (const auto& r : records) checkpoint_times_.push_back(r.t0);
  std::sort(checkpoint_times_.begin(), checkpoint_times_.end());
  // IDAS chooses its first step without an evaluation.
  const double first = t_ - plan_->limit(system_, t_, y(), true);
  if (std::isfinite(first) && !(options_.max_step_s > 0 && options_.max_step_s < first))
    check(IDASetMaxStepB(memory_, backward_->which, first), "IDASetMaxStepB");
}

void IdaSession::look_back(double t, const double* y) {
  if (!plan_) return;
  // At a checkpoint, but for rounding, it has to stop there.
  const double near = 1e-13 * (std::abs(t) + std::abs(t_ - options_.t_start));
  const auto above = std::upper_bound(checkpoint_times_.begin(), checkpoint_times_.end(), t + near);
  const double floor = above == checkpoint_times_.begin() ? options_.t_start : *(above - 1);
  const double end = floor >= t - near ? floor : std::max(floor, plan_->limit(system_, t, y, true));
  void* memory = IDAGetAdjIDABmem(memory_, backward_->which);
  IDASetMaxStep(memory, std::max(0.0, options_.max_step_s));
  IDASetStopTime(memory, end);
}

const IdaSession::Backward& IdaSession::backward_cost_gradient(double t, const double* x) {
  Backward& b = *backward_;
  if (t != b.cost_time) {
    std::fill(b.g_rho.begin(), b.g_rho.end(), 0.0);
    system_.running_cost_gradient(t, x, b.g_y.data(), 1, b.g_rho.data());
    b.cost_time = t;
  }
  return b;
}

// Behind the adjoint IDAS carries one differential unknown of its own: the integral of a weighted sum of the gradient's
// integrands. The gradient is that of the quadratures; this unknown is there for the choice of the order. IDAS asks the
// unknowns first whether a lower order would do, and the quadratures only where these said no: an adjoint that is
// constant has an error of 0 <= 0 at any order, and IDAS would stay at order 1 whatever the gradient needs; one that is
// a polynomial, at its degree.
void IdaSession::begin_sum() {
  // In units of what the integrals get to at this rate, at least of their tolerances, with weights of no simple ratio:
  // a sum that vanishes hides nothing but by chance.
  Backward& b = *backward_;
  const int n = system_.size();
  const double* x = solved.at(system_, t_, y());
  system_.linearize(t_, x, yp());
  b.integrand.assign(b.g_rho.size(), 0);
  backward_integrand(t_, x, b.y.data(), b.integrand.data());
  for (std::size_t j = 0; j < b.integrand.size(); ++j) {
    const double reach =
        std::max(b.atol_q.data()[j] / options_.rtol, std::abs(b.integrand[j]) * (t_ - options_.t_start));
    b.sum_weights.push_back((1 + 0.5 * std::sin(1 + 2.3 * static_cast<double>(j))) / reach);
  }
  b.id.data()[n] = 1;
  b.atol.data()[n] = options_.rtol;
  b.yp.data()[n] = backward_sum_rate(t_, x, b.y.data());
}

void IdaSession::backward_integrand(double t, const double* x, const double* mu, double* q) {
  // Integrated from T down to 0, so the sign of g_rho - mu^T F_rho is turned.
  const Backward& b = backward_cost_gradient(t, x);
  for (std::size_t j = 0; j < b.g_rho.size(); ++j) q[j] = -b.g_rho[j];
  system_.add_parameter_gradient(1, mu, q);
}

double IdaSession::backward_sum_rate(double t, const double* x, const double* mu) {
  Backward& b = *backward_;
  backward_integrand(t, x, mu, b.integrand.data());
  double rate = 0;
  for (std::size_t j = 0; j < b.integrand.size(); ++j) rate += b.sum_weights[j] * b.integrand[j];
  return rate;
}

// The sum's row of Newton's system, cj ds - w^T F_rho^T dmu = r: without its block beside the diagonal the sum would
// have the predicted adjoint's error, and that of its algebraic part is in no norm.
void IdaSession::solve_sum(double* x) {
  Backward& b = *backward_;
  std::fill(b.integrand.begin(), b.integrand.end(), 0.0);
  system_.add_parameter_gradient(1, x, b.integrand.data());
  double& sum = x[system_.size()];
  for (std::size_t j = 0; j < b.integrand.size(); ++j) sum += b.sum_weights[j] * b.integrand[j];
  sum /= b.cj;
}

std::vector<Unknown> IdaSession::names_back() const {
  std::vector<Unknown> names = adjoint_names(system_.unknowns());
  if (summed_back() > 0) names.push_back({"gradient", "1", Unknown::Role::force_state, true, true});
  return names;
}

int IdaSession::backward_residual(double t, N_Vector y, N_Vector yp, N_Vector yB, N_Vector ypB, N_Vector rB, void* p) {
  IdaSession& s = self_of(p);
  return s.guard_.run([&] {
    s.poll(t, true);
    s.watch_->backward();
    // E mu' - F_y^T mu + g_y = 0
    double* r = data(rB);
    const int n = s.system_.size();
    const double* x = solved.at(s.system_, t, s.forward(t, y));
    s.adjoint_growth_.look(t, x, data(yB), s.system_.unknowns(), s.options_.rtol, s.options_.absolute());
    s.system_.linearize(t, x, data(yp));
    const Backward& b = s.backward_cost_gradient(t, x);
    std::copy(b.g_y.begin(), b.g_y.end(), r);
    const double *id = s.id_.data(), *mup = data(ypB);
    for (int i = 0; i < n; ++i) r[i] += id[i] * mup[i];
    s.system_.add_transposed_product(-1, data(yB), r);
    if (s.summed_back() > 0) r[n] = mup[n] - s.backward_sum_rate(t, x, data(yB));
    s.look_back(t, x);
  });
}

int IdaSession::backward_jacobian(double t, double cj, N_Vector y, N_Vector yp, N_Vector, N_Vector, N_Vector, SUNMatrix,
                                  void* p, N_Vector, N_Vector, N_Vector) {
  IdaSession& s = self_of(p);
  return s.guard_.run([&] {
    s.system_.factor(t, solved.at(s.system_, t, s.forward(t, y)), data(yp), -cj);
    s.backward_->cj = cj;
  });
}

int IdaSession::backward_quadrature(double t, N_Vector y, N_Vector yp, N_Vector yB, N_Vector, N_Vector qB, void* p) {
  IdaSession& s = self_of(p);
  return s.guard_.run([&] {
    const double* x = solved.at(s.system_, t, s.forward(t, y));
    s.system_.linearize(t, x, data(yp));
    s.backward_integrand(t, x, data(yB), data(qB));
  });
}

}  // namespace costate
