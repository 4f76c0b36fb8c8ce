#include "costate/adjoint/tangent_equations.h"

#include "costate/analysis/start.h"
#include "costate/assembly/slip_directions.h"

namespace costate {

TangentEquations::TangentEquations(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                   Objective objective, Stabilization stabilization, Constraints constraints)
    : HandEquations(std::move(mechanism), std::move(parameters), std::move(objective), stabilization,
                    Direction::forward),
      constraints_(constraints) {
  const auto coordinates = assembly_.mechanism().coordinate_names();
  const auto rows = assembly_.mechanism().row_names();
  add_rows("S.", coordinates, true);
  add_rows("S.d/dt ", coordinates, true);
  add_rows("S.", assembly_.mechanism().state_names(), true);
  add_rows("S.d2/dt2 ", coordinates, false);
  add_rows("S.lambda.", rows, false);
  if (constraints == Constraints::index2) add_rows("S.gamma.", rows, false);
  const int q = 0, v = n_, z = 2 * n_, a = z + nz_, l = a + n_, g = l + m_;
  const SparsePattern In = SparsePattern::identity(n_), Iz = SparsePattern::identity(nz_);
  at_.Dq = place(In, q, q);
  at_.Dv = place(In, v, v);
  at_.Dz = place(Iz, z, z);
  at_.q_v = place(In, q, v);
  at_.v_a = place(In, v, a);
  at_.z_q = place(assembly_.state_force(), z, q);
  at_.z_v = place(assembly_.state_force(), z, v);
  at_.z_z = place(assembly_.state_state(), z, z);
  at_.K = place(assembly_.square(), a, q);
  at_.C = place(assembly_.square(), a, v);
  at_.Q_z = place(assembly_.force_state(), a, z);
  at_.M = place(assembly_.square(), a, a);
  at_.phi_t = place(assembly_.jacobian(), a, l, true);
  at_.r_q = place(assembly_.jacobian(), l, q);
  at_.r_v = place(assembly_.jacobian(), l, v);
  at_.r_a = place(assembly_.jacobian(), l, a);
  at_.corner = -1;
  if (constraints == Constraints::acceleration || (carries_switched_rows() && assembly_.has_switched_rows()))
    at_.corner = place(level_.corner_pattern(), l, l);
  if (constraints == Constraints::index2) {
    if (at_.corner >= 0) at_.gamma_corner = place(SparsePattern::identity(m_), g, g);
    at_.q_g = place(assembly_.jacobian(), q, g, true);
    at_.p_q = place(assembly_.jacobian(), g, q);
  }
  finalize();
}

void TangentEquations::fill() {
  D_.add_constant(at_.Dq, 1);
  D_.add_constant(at_.Dv, 1);
  D_.add_constant(at_.Dz, 1);
  A_.add_constant(at_.q_v, 1);
  A_.add_constant(at_.v_a, 1);
  A_.add(at_.z_q, assembly_.f_q.data());
  A_.add(at_.z_v, assembly_.f_v.data());
  A_.add(at_.z_z, assembly_.f_z.data());
  A_.add(at_.K, assembly_.K.data());
  A_.add(at_.C, assembly_.C.data());
  A_.add(at_.Q_z, assembly_.Q_z.data(), -1);
  A_.add(at_.M, assembly_.M.data());
  A_.add(at_.phi_t, assembly_.reaction_jacobian().data());
  const Assembly::ParameterColumns& c = parameter_columns();
  const int z = 2 * n_, a = z + nz_, l = a + n_;
  b_.middleRows(z, nz_) = c.f;
  b_.middleRows(a, n_) = c.F;
  switch (constraints_) {
    case Constraints::acceleration:
      A_.add(at_.r_q, level_.R2_q().data());
      A_.add(at_.r_v, level_.R2_v().data());
      A_.add(at_.r_a, assembly_.phi_q.data());
      A_.add(at_.corner, level_.corner());
      b_.middleRows(l, m_) = level_.constraint_columns(c);
      break;
    case Constraints::index2:
      A_.add(at_.q_g, assembly_.phi_q.data(), -1);
      A_.add(at_.r_q, assembly_.phid_q.data());
      A_.add(at_.r_v, assembly_.phi_q.data());
      A_.add(at_.p_q, assembly_.phi_q.data());
      b_.middleRows(l, m_) = c.phid;
      b_.middleRows(l + m_, m_) = c.phi;
      if (at_.corner >= 0) switch_rows(c);
      break;
    case Constraints::index3:
      A_.add(at_.r_q, assembly_.phi_q.data());
      b_.middleRows(l, m_) = c.phi;
      break;
  }
}

// Index 2, as the formulation has it: the corner of R2 where a row is not there or a contact slides, -Sg = 0 where no
// position is kept.
void TangentEquations::switch_rows(const Assembly::ParameterColumns& c) {
  const int l = 3 * n_ + nz_, g = l + m_;
  A_.add(at_.corner, level_.corner());
  std::vector<double> slip_q, slip_v;
  slip_partials(assembly_, state(), slip_q, slip_v);
  if (!slip_q.empty()) {
    A_.add(at_.r_q, slip_q.data());
    A_.add(at_.r_v, slip_v.data());
  }
  for (const Assembly::SlidingRow& r : assembly_.sliding_rows()) b_.row(l + r.along) = c.phidd.row(r.along);
  const auto kept = [&](int i) { return assembly_.is_there(i) && assembly_.holds_position(i); };
  std::vector<double> lost = assembly_.phi_q, gamma(static_cast<std::size_t>(m_));
  for (std::size_t k = 0; k < lost.size(); ++k)
    if (kept(assembly_.jacobian().row[k])) lost[k] = 0;
  A_.add(at_.p_q, lost.data(), -1);
  for (int i = 0; i < m_; ++i) {
    gamma[static_cast<std::size_t>(i)] = level_.stabilizer_corner(i);
    if (!kept(i)) b_.row(g + i).setZero();
  }
  A_.add(at_.gamma_corner, gamma.data());
}

void TangentEquations::begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  const Start s = start();
  Eigen::VectorXd y(2 * n_ + nz_);
  y << s.q, s.v, s.z;
  evaluate(t_start, y.data());
  Eigen::MatrixXd Y(2 * n_ + nz_, columns());
  Y << s.q_rho, s.v_rho, s.z_rho;
  from_states(Y, X, gradient);
}

Eigen::MatrixXd TangentEquations::of_states(const Eigen::MatrixXd& X) { return X.topRows(2 * n_ + nz_); }

void TangentEquations::from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd&) {
  X.setZero(size(), columns());
  X.topRows(2 * n_ + nz_) = Y;
  solve_tangent_accelerations(Y.topRows(n_), Y.middleRows(n_, n_), Y.bottomRows(nz_), Sa_, Sl_);
  X.middleRows(2 * n_ + nz_, n_ + m_) << Sa_, Sl_;
}

void TangentEquations::split(const Eigen::MatrixXd& X, bool with_accelerations) {
  Sq_ = X.topRows(n_);
  Sv_ = X.middleRows(n_, n_);
  Sz_ = X.middleRows(2 * n_, nz_);
  // At lower constraint levels Sa and Sl lose orders of accuracy; the cost takes them from Sq and Sv instead.
  if (constraints_ == Constraints::acceleration || !with_accelerations) {
    Sa_ = X.middleRows(2 * n_ + nz_, n_);
    Sl_ = X.middleRows(3 * n_ + nz_, m_);
  } else {
    solve_tangent_accelerations(Sq_, Sv_, Sz_, Sa_, Sl_);
  }
}

void TangentEquations::integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) {
  split(X, objective_.running_needs_accelerations());
  add_running_tangent(Sq_, Sv_, Sz_, Sa_, Sl_, out);
}

void TangentEquations::finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  split(X, objective_.terminal_needs_accelerations());
  add_terminal_tangent(Sq_, Sv_, Sz_, Sa_, Sl_, gradient);
}

}  // namespace costate
