// IDAS's side of the way back: lib/README.md (6).
#include <algorithm>
#include <cmath>
#include <iterator>

#include "costate/integrator/ida_session.h"
#include "costate/sundials/failure.h"

namespace costate {

AdjointState IdaSession::end_adjoint(std::vector<double>& gradient) {
  AdjointState mu;
  mu.mu.assign(static_cast<std::size_t>(system_.size()), 0);
  mu.mup = mu.mu;
  system_.terminal_adjoint(t_, y(), yp_.data(), mu.mu.data(), mu.mup.data(), gradient.data());
  return mu;
}

void IdaSession::transfer_adjoint(DaeSystem& system, const Jump& jump, AdjointState& mu,
                                  std::vector<double>& gradient) {
  system.jump_adjoint(jump, mu.mu.data(), mu.mup.data(), gradient.data());
}

void IdaSession::add_start_gradient(const AdjointState& mu, std::vector<double>& gradient) const {
  // mu(0)^T F_y' y_rho(0)
  if (y_rho_.size() == 0) return system_.add_start_gradient(options_.t_start, mu.mu.data(), gradient.data());
  for (int j = 0; j < system_.parameter_count(); ++j)
    for (int i = 0; i < system_.size(); ++i)
      if (id_.data()[i] != 0) gradient[j] += mu.mu[i] * y_rho_(i, j);
}

void IdaSession::create_backward() {
  Backward& b = *back_;
  const int n = system_.size();
  solved_.forget();
  cost_time_ = std::numeric_limits<double>::quiet_NaN();
  g_y_back_.assign(static_cast<std::size_t>(n), 0);
  g_rho_.assign(static_cast<std::size_t>(system_.parameter_count()), 0);
  id_back_ = Vector(b.y.size(), context_);
  std::copy(id_.data(), id_.data() + n, id_back_.data());
  if (summed_back() > 0) begin_sum();
  check(IDACreateB(memory_, &b.which), "the adjoint");
  check(IDAInitB(memory_, b.which, backward_residual, t_, b.y, b.yp), "the adjoint's start");
  check(IDASetIdB(memory_, b.which, id_back_), "the adjoint's algebraic unknowns");
  check(IDASetSuppressAlgB(memory_, b.which, SUNTRUE), "the adjoint's algebraic unknowns");
}

namespace {
// As for the way forward (ida_session.cpp). The algebraic adjoints are in no norm, in any formulation: at IDAS's own
// 0.33 that of heavy_top by baumgarte took three times the evaluations, flyball_governor's was ten times further off.
constexpr double kNewtonBack = 0.03;
// At index 2 and 3, in the order in which they are tried.
constexpr double kNewtonOfStatesBack[] = {1e-2, 1e-4, 1e-3, 1e-5};
}  // namespace

int IdaSession::attempts_back() const {
  return iterates_on_accelerations() ? 1 : static_cast<int>(std::size(kNewtonOfStatesBack));
}

void IdaSession::begin_attempt_back(int attempt) {
  check(IDASetNonlinConvCoef(back_->memory, iterates_on_accelerations() ? kNewtonBack : kNewtonOfStatesBack[attempt]),
        "the tolerance of Newton's iterations");
}

void IdaSession::set_backward_matrix() {
  check(IDASetJacFnB(memory_, back_->which, backward_jacobian), "the adjoint's Jacobian");
  check(IDASetLinearSolutionScaling(back_->memory, SUNFALSE), "the adjoint's Newton operator");
  iterations_back_.emplace(back_->y, 0, context_, newton_setups_back_, some_outside_norm());
  check(
      iterations_back_->attach([&](SUNNonlinearSolver s) { return IDASetNonlinearSolverB(memory_, back_->which, s); }),
      "the adjoint's Newton's method");
}

// J_B = cj E - F_y^T = -(F_y - cj E)^T: the forward Newton matrix at -cj, solved transposed.
void IdaSession::solve_newton_back(double* x) {
  scale_newton(back_->memory, cj_back_, id_back_, x);
  system_.solve_transposed(x);
  for (int i = 0; i < system_.size(); ++i) x[i] = -x[i];
  if (summed_back() > 0) solve_sum(x);
}

void IdaSession::backward_cost_gradient(double t, const double* x) {
  if (t == cost_time_) return;
  std::fill(g_rho_.begin(), g_rho_.end(), 0.0);
  system_.running_cost_gradient(t, x, g_y_back_.data(), 1, g_rho_.data());
  cost_time_ = t;
}

// Behind the adjoint IDAS carries one differential unknown of its own: the integral of a weighted sum of the gradient's
// integrands. The gradient is that of the quadratures; this unknown is there for the choice of the order. IDAS asks the
// unknowns first whether a lower order would do, and the quadratures only where these said no: an adjoint that is
// constant has an error of 0 <= 0 at any order, and IDAS would stay at order 1 whatever the gradient needs; one that is
// a polynomial, at its degree.
void IdaSession::begin_sum() {
  // In units of what the integrals get to at this rate, at least of their tolerances, with weights of no simple ratio:
  // a sum that vanishes hides nothing but by chance.
  Backward& b = *back_;
  const int n = system_.size();
  const double* x = solved_.at(system_, t_, y());
  system_.linearize(t_, x, yp_.data());
  integrand_.assign(g_rho_.size(), 0);
  sum_weights_.clear();
  backward_integrand(t_, x, b.y.data(), integrand_.data());
  for (std::size_t j = 0; j < integrand_.size(); ++j) {
    const double reach =
        std::max(b.atol_q.data()[j] / options_.rtol, std::abs(integrand_[j]) * (t_ - options_.t_start));
    sum_weights_.push_back((1 + 0.5 * std::sin(1 + 2.3 * static_cast<double>(j))) / reach);
  }
  id_back_.data()[n] = 1;
  b.atol.data()[n] = options_.rtol;
  b.yp.data()[n] = backward_sum_rate(t_, x, b.y.data());
}

void IdaSession::complete_backward(const AdjointStop& stop) {
  cost_time_ = std::numeric_limits<double>::quiet_NaN();
  solved_.forget();
  if (summed_back() == 0) return;
  Backward& b = *back_;
  const int n = system_.size();
  const double* x = solved_.at(system_, stop.to, stop.y);
  system_.linearize(stop.to, x, stop.yp);
  b.atol.data()[n] = options_.rtol;
  b.yp.data()[n] = backward_sum_rate(stop.to, x, b.y.data());
}

void IdaSession::backward_integrand(double t, const double* x, const double* mu, double* q) {
  // Integrated from T down to 0, so the sign of g_rho - mu^T F_rho is turned.
  backward_cost_gradient(t, x);
  for (std::size_t j = 0; j < g_rho_.size(); ++j) q[j] = -g_rho_[j];
  system_.add_parameter_gradient(1, mu, q);
}

double IdaSession::backward_sum_rate(double t, const double* x, const double* mu) {
  backward_integrand(t, x, mu, integrand_.data());
  double rate = 0;
  for (std::size_t j = 0; j < integrand_.size(); ++j) rate += sum_weights_[j] * integrand_[j];
  return rate;
}

// The sum's row of Newton's system, cj ds - w^T F_rho^T dmu = r: without its block beside the diagonal the sum would
// have the predicted adjoint's error, and that of its algebraic part is in no norm.
void IdaSession::solve_sum(double* x) {
  std::fill(integrand_.begin(), integrand_.end(), 0.0);
  system_.add_parameter_gradient(1, x, integrand_.data());
  double& sum = x[system_.size()];
  for (std::size_t j = 0; j < integrand_.size(); ++j) sum += sum_weights_[j] * integrand_[j];
  sum /= cj_back_;
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
    const double* x = s.solved_.at(s.system_, t, s.forward(t, y));
    s.adjoint_growth_.look(t, x, data(yB), s.system_, s.options_.rtol, s.options_.absolute());
    s.system_.linearize(t, x, data(yp));
    s.backward_cost_gradient(t, x);
    std::copy(s.g_y_back_.begin(), s.g_y_back_.end(), r);
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
  ++s.newton_setups_back_;
  return s.guard_.run([&] {
    s.system_.factor(t, s.solved_.at(s.system_, t, s.forward(t, y)), data(yp), -cj);
    s.cj_back_ = cj;
  });
}

int IdaSession::backward_quadrature(double t, N_Vector y, N_Vector yp, N_Vector yB, N_Vector, N_Vector qB, void* p) {
  IdaSession& s = self_of(p);
  return s.guard_.run([&] {
    const double* x = s.solved_.at(s.system_, t, s.forward(t, y));
    s.system_.linearize(t, x, data(yp));
    s.backward_integrand(t, x, data(yB), data(qB));
  });
}

}  // namespace costate
