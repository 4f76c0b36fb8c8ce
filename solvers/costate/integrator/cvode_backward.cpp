// The backward half of CvodeSession: the adjoint problem, segment by segment.
#include <cvodes/cvodes.h>

#include <algorithm>
#include <cmath>

#include "costate/integrator/cvode_session.h"
#include "costate/sundials/failure.h"
#include "costate/sundials/message_capture.h"

namespace costate {

std::vector<double> CvodeSession::solve_adjoint() {
  std::vector<double> gradient(static_cast<std::size_t>(system_.parameter_count()), 0);
  AdjointState mu = end_adjoint(gradient);
  solve_backward(mu, adjoint_scale_.size(t_ - options_.t_start), gradient);
  add_start_gradient(mu, gradient);
  return gradient;
}

AdjointState CvodeSession::end_adjoint(std::vector<double>& gradient) {
  AdjointState mu;
  mu.mu.assign(static_cast<std::size_t>(system_.size()), 0);
  system_.terminal_adjoint(t_, y(), mu.mu.data(), gradient.data());
  return mu;
}

void CvodeSession::transfer_adjoint(OdeSystem& system, const Jump& jump, AdjointState& mu,
                                    std::vector<double>& gradient) {
  system.jump_adjoint(jump, mu.mu.data(), gradient.data());
}

void CvodeSession::add_start_gradient(const AdjointState& mu, std::vector<double>& gradient) const {
  for (int j = 0; j < system_.parameter_count(); ++j)
    for (int i = 0; i < system_.size(); ++i) gradient[j] += mu.mu[i] * y_rho_(i, j);
}

void CvodeSession::solve_backward(AdjointState& mu, const AdjointSize& expected, std::vector<double>& gradient) {
  if (t_ <= options_.t_start) return;  // two events at once: nothing between them
  const int n = system_.size(), np = system_.parameter_count();
  backward_ = std::make_unique<Backward>();
  Backward& b = *backward_;
  b.y = Vector(n, context_);
  b.q = Vector(np, context_);
  b.atol = Vector(n, context_);
  b.atol_q = Vector(np, context_);
  std::copy(mu.mu.begin(), mu.mu.end(), b.y.data());
  const double scale =
      set_adjoint_tolerances(system_.unknowns(), mu.mu, expected, options_.rtol, options_.rtol, b.atol.data());
  set_gradient_tolerances(system_, y(), scale, options_.rtol, b.atol_q.data());

  check(CVodeCreateB(memory_, linear_multistep(), &b.which), "CVodeCreateB");
  check(CVodeInitB(memory_, b.which, backward_rhs, t_, b.y), "CVodeInitB");
  check(CVodeSetUserDataB(memory_, b.which, this), "CVodeSetUserDataB");
  check(CVodeSVtolerancesB(memory_, b.which, options_.rtol, b.atol), "CVodeSVtolerancesB");
  check(CVodeSetMaxNumStepsB(memory_, b.which, options_.max_steps), "CVodeSetMaxNumStepsB");
  if (options_.max_step_s > 0) check(CVodeSetMaxStepB(memory_, b.which, options_.max_step_s), "CVodeSetMaxStepB");
  b.newton = std::make_unique<NewtonOperator>(context_, guard_, [this](double* x) { system_.solve_transposed(x); });
  check(CVodeSetLinearSolverB(memory_, b.which, b.newton->solver(), b.newton->matrix()), "CVodeSetLinearSolverB");
  check(CVodeSetLinSysFnB(memory_, b.which, backward_newton_matrix), "CVodeSetLinSysFnB");
  void* memory_b = CVodeGetAdjCVodeBmem(memory_, b.which);
  if (np > 0) {
    check(CVodeQuadInitB(memory_, b.which, backward_quadrature, b.q), "CVodeQuadInitB");
    check(CVodeQuadSVtolerancesB(memory_, b.which, options_.rtol, b.atol_q), "CVodeQuadSVtolerancesB");
    check(CVodeSetQuadErrConB(memory_, b.which, SUNTRUE), "CVodeSetQuadErrConB");
  }
  read_checkpoints();
  capture_cvode_messages(memory_b, message_);
  const int flag = CVodeB(memory_, options_.t_start, CV_NORMAL);
  if (flag < 0)
    fail(memory_b, flag, "CVODES could not continue the backward (adjoint) run", adjoint_names(system_.unknowns()));
  double reached = 0;
  check(CVodeGetB(memory_, b.which, &reached, b.y), "CVodeGetB");
  if (np > 0) {
    check(CVodeGetQuadB(memory_, b.which, &reached, b.q), "CVodeGetQuadB");
    for (int j = 0; j < np; ++j) gradient[j] += b.q.data()[j];
  }
  std::copy(b.y.data(), b.y.data() + n, mu.mu.begin());
  Counters& c = counters_;
  CVodeGetNumSteps(memory_b, &c.backward_steps);
  CVodeGetNumRhsEvals(memory_b, &c.backward_residuals);
  CVodeGetNumNonlinSolvIters(memory_b, &c.backward_newton_iterations);
  CVodeGetNumErrTestFails(memory_b, &c.backward_error_test_failures);
  CVodeGetNumNonlinSolvConvFails(memory_b, &c.backward_convergence_failures);
  c.backward_jacobians = backward_setups_;
  c.factorizations = system_.factorizations();
  c.position_iterations = system_.position_iterations();
}

void CvodeSession::read_checkpoints() {
  checkpoint_times_.clear();
  if (!plan_) return;
  std::vector<CVadjCheckPointRec> records(static_cast<std::size_t>(counters_.checkpoints) + 1);
  check(CVodeGetAdjCheckPointsInfo(memory_, records.data()), "CVodeGetAdjCheckPointsInfo");
  for (const auto& r : records) checkpoint_times_.push_back(r.t0);
  std::sort(checkpoint_times_.begin(), checkpoint_times_.end());
}

void CvodeSession::look_back(double t, const double* y) {
  if (!plan_) return;
  // At a checkpoint, but for rounding, it has to stop there.
  const double near = 1e-13 * (std::abs(t) + std::abs(t_ - options_.t_start));
  const auto above = std::upper_bound(checkpoint_times_.begin(), checkpoint_times_.end(), t + near);
  const double floor = above == checkpoint_times_.begin() ? options_.t_start : *(above - 1);
  const double end = floor >= t - near ? floor : std::max(floor, plan_->limit(system_, t, y, true));
  CVodeSetStopTime(CVodeGetAdjCVodeBmem(memory_, backward_->which), end);
}

int CvodeSession::backward_rhs(double t, N_Vector y, N_Vector yB, N_Vector fB, void* p) {
  CvodeSession& s = self_of(p);
  return s.guard_.run([&] {
    s.poll(t, true);
    s.watch_->backward();
    const double* x = s.forward(t, y);
    s.adjoint_growth_.look(t, x, data(yB), s.system_.unknowns(), s.options_.rtol, s.options_.absolute());
    s.system_.adjoint_rhs(t, x, data(yB), data(fB));
    s.look_back(t, x);
  });
}

int CvodeSession::backward_newton_matrix(double t, N_Vector y, N_Vector, N_Vector, SUNMatrix, int, int* jcur,
                                         double gamma, void* p, N_Vector, N_Vector, N_Vector) {
  CvodeSession& s = self_of(p);
  ++s.backward_setups_;
  *jcur = SUNTRUE;
  // I - gamma (-f_y^T) = (I - (-gamma) f_y)^T
  return s.guard_.run([&] { s.system_.factor(t, s.forward(t, y), -gamma); });
}

int CvodeSession::backward_quadrature(double t, N_Vector y, N_Vector yB, N_Vector qB, void* p) {
  CvodeSession& s = self_of(p);
  return s.guard_.run([&] {
    s.system_.adjoint_integrand(t, s.forward(t, y), data(yB), data(qB));
    // Integrated from T down to 0, so the sign is turned.
    for (int j = 0; j < s.system_.parameter_count(); ++j) data(qB)[j] = -data(qB)[j];
  });
}

}  // namespace costate
