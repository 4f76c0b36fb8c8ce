// CVODES's side of the way back.
#include "costate/integrator/cvode_session.h"
#include "costate/sundials/failure.h"

namespace costate {

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
  if (y_rho_.size() == 0) return system_.add_start_gradient(options_.t_start, mu.mu.data(), gradient.data());
  for (int j = 0; j < system_.parameter_count(); ++j)
    for (int i = 0; i < system_.size(); ++i) gradient[j] += mu.mu[i] * y_rho_(i, j);
}

std::vector<Unknown> CvodeSession::names_back() const { return adjoint_names(system_.unknowns()); }

void CvodeSession::create_backward() {
  check(CVodeCreateB(memory_, linear_multistep(), &back_->which), "the adjoint");
  check(CVodeInitB(memory_, back_->which, backward_rhs, t_, back_->y), "the adjoint's start");
}

void CvodeSession::set_backward_matrix() {
  check(CVodeSetLinSysFnB(memory_, back_->which, backward_newton_matrix), "the adjoint's Newton matrix");
}

int CvodeSession::backward_rhs(double t, N_Vector y, N_Vector yB, N_Vector fB, void* p) {
  CvodeSession& s = self_of(p);
  return s.guard_.run([&] {
    s.poll(t, true);
    s.watch_->backward();
    const double* x = s.forward(t, y);
    s.adjoint_growth_.look(t, x, data(yB), s.system_, s.options_.rtol, s.options_.absolute());
    s.system_.adjoint_rhs(t, x, data(yB), data(fB));
    s.look_back(t, x);
    s.watch_stiffness_back(t, x);
  });
}

int CvodeSession::backward_newton_matrix(double t, N_Vector y, N_Vector, N_Vector, SUNMatrix, int, int* jcur,
                                         double gamma, void* p, N_Vector, N_Vector, N_Vector) {
  CvodeSession& s = self_of(p);
  ++s.newton_setups_back_;
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
