#include "costate/adjoint/acceleration_adjoint.h"

#include "costate/analysis/start.h"

namespace costate {

AccelerationAdjoint::AccelerationAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                         Objective objective, Stabilization stabilization)
    : HandEquations(std::move(mechanism), std::move(parameters), std::move(objective), stabilization,
                    Direction::backward) {
  const auto coordinates = assembly_.mechanism().coordinate_names();
  const auto rows = assembly_.mechanism().row_names();
  add_rows("mu_q.", coordinates, true);
  add_rows("mu_v.", coordinates, true);
  add_rows("mu_z.", assembly_.mechanism().state_names(), true);
  add_rows("s1.", coordinates, false);
  add_rows("s2.", rows, false);
  const int q = 0, v = n_, z = 2 * n_, a = z + nz_, l = a + n_;
  const SparsePattern In = SparsePattern::identity(n_), Iz = SparsePattern::identity(nz_),
                      &corner = level_.corner_pattern();
  at_.Dq = place(In, q, q);
  at_.Dv = place(In, v, v);
  at_.Dz = place(Iz, z, z);
  at_.q_s1 = place(assembly_.square(), q, a, true);
  at_.q_s2 = place(assembly_.jacobian(), q, l, true);
  at_.q_z = place(assembly_.state_force(), q, z, true);
  at_.v_q = place(In, v, q);
  at_.v_s1 = place(assembly_.square(), v, a, true);
  at_.v_s2 = place(assembly_.jacobian(), v, l, true);
  at_.v_z = place(assembly_.state_force(), v, z, true);
  at_.z_s1 = place(assembly_.force_state(), z, a, true);
  at_.z_z = place(assembly_.state_state(), z, z, true);
  at_.s_M = place(assembly_.square(), a, a);
  at_.s_phi_t = place(assembly_.jacobian(), a, l, true);
  at_.s_v = place(In, a, v);
  at_.s_phi = place(assembly_.jacobian(), l, a);
  at_.corner = place(corner, l, l, true);
  finalize();
}

void AccelerationAdjoint::fill() {
  D_.add_constant(at_.Dq, 1);
  D_.add_constant(at_.Dv, 1);
  D_.add_constant(at_.Dz, 1);
  A_.add(at_.q_s1, assembly_.K.data());
  A_.add(at_.q_s2, level_.R2_q().data());
  A_.add(at_.q_z, assembly_.f_q.data(), -1);
  A_.add_constant(at_.v_q, -1);
  A_.add(at_.v_s1, assembly_.C.data());
  A_.add(at_.v_s2, level_.R2_v().data());
  A_.add(at_.v_z, assembly_.f_v.data(), -1);
  A_.add(at_.z_s1, assembly_.Q_z.data(), -1);
  A_.add(at_.z_z, assembly_.f_z.data(), -1);
  A_.add(at_.s_M, assembly_.M.data());
  A_.add(at_.s_phi_t, assembly_.phi_q.data());
  A_.add_constant(at_.s_v, -1);
  A_.add(at_.s_phi, assembly_.reaction_jacobian().data());
  A_.add(at_.corner, level_.corner());
  const ScalarGradient& g = running_gradient();
  b_.col(0) << -g.q, -g.v, -g.z, -g.a, -g.lambda;
}

void AccelerationAdjoint::begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  Eigen::VectorXd wq, wv, wz;
  eliminate_terminal(wq, wv, wz, gradient);
  Eigen::VectorXd w(2 * n_ + nz_);
  w << wq, wv, wz;
  from_states(w, X, gradient);
}

Eigen::MatrixXd AccelerationAdjoint::of_states(const Eigen::MatrixXd& X) { return X.topRows(2 * n_ + nz_); }

void AccelerationAdjoint::from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd&) {
  const ScalarGradient& g = running_gradient();
  Eigen::VectorXd s(n_ + m_);
  s << Y.col(0).segment(n_, n_) + g.a, g.lambda;
  level_.solve_kkt_transposed(s.data());
  X.resize(size(), 1);
  X.col(0) << Y.col(0), s;
}

void AccelerationAdjoint::integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) {
  out = running_gradient().rho;
  const double *mu_z = X.data() + 2 * n_, *s1 = mu_z + nz_;
  const auto w = level_.stabilization().weights(s1, s1 + n_, mu_z);
  go_to_slips();
  assembly_.add_parameter_gradient(state(), w, -1, out.data());
}

void AccelerationAdjoint::finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  const double* mu = X.data();
  add_start_gradient(mu, mu + n_, mu + 2 * n_, gradient);
}

}  // namespace costate
