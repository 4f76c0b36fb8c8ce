#include "costate/adjoint/maggi_adjoint.h"

#include "costate/analysis/start.h"

namespace costate {

namespace {
Eigen::MatrixXd rows_of(const Eigen::MatrixXd& A, const std::vector<int>& rows) {
  Eigen::MatrixXd out(static_cast<Eigen::Index>(rows.size()), A.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) out.row(static_cast<Eigen::Index>(i)) = A.row(rows[i]);
  return out;
}
}  // namespace

MaggiAdjoint::MaggiAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                           Objective objective)
    : MaggiEquations(std::move(mechanism), std::move(parameters), std::move(objective), Direction::backward) {}

// mu(T) = w in (z, zd, zf), accelerations and multipliers eliminated (0.8).
void MaggiAdjoint::begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  evaluate_parameters();
  const MaggiBlocks::Reduced w = at_.reduce_and_eliminate(terminal_gradient());
  gradient += w.rho;
  X = join({w.z, w.zd, w.zf});
}

void MaggiAdjoint::integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) {
  evaluate_parameters();
  out = at_.reduce(running_gradient(), true).rho - at_.Fz.transpose() * multiplier(X.col(0)) +
        at_.Zr.transpose() * force_states(X.col(0));
}

void MaggiAdjoint::finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  const Start& s = start();
  evaluate_start();
  const Adjoint mu = split(X.col(0));
  gradient += rows_of(s.q_rho, at_.independent()).transpose() * mu.z +
              rows_of(s.v_rho, at_.independent()).transpose() * mu.zd + s.z_rho.transpose() * mu.f;
  begin_afresh();
}

// (5.12)
void MaggiAdjoint::change_chart(int to, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  const Eigen::MatrixXd Y = of_states(X);
  evaluate_in_chart(to);
  from_states(Y, X, gradient);
}

// The weights B^T mu_z of dq and B^T mu_zd of dv.
Eigen::MatrixXd MaggiAdjoint::of_states(const Eigen::MatrixXd& X) {
  const Adjoint mu = split(X.col(0));
  const auto& independent = at_.independent();
  Eigen::MatrixXd Y = Eigen::MatrixXd::Zero(2 * n_ + nz_, 1);
  for (int i = 0; i < f_; ++i) {
    Y(independent[static_cast<std::size_t>(i)], 0) = mu.z[i];
    Y(n_ + independent[static_cast<std::size_t>(i)], 0) = mu.zd[i];
  }
  Y.bottomRows(nz_) = mu.f;
  return Y;
}

// With (5.9): dq = R dz + Nr drho, dv = R dzd + D dz + Vr drho.
void MaggiAdjoint::from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  evaluate_parameters();
  const Eigen::VectorXd q = Y.col(0).head(n_), v = Y.col(0).segment(n_, n_);
  gradient += at_.Nr.transpose() * q + at_.Vr.transpose() * v;
  X = join({at_.R.transpose() * q + at_.D.transpose() * v, at_.R.transpose() * v, Y.col(0).tail(nz_)});
}

// Explicit form of first order: (5.5), with mu = Mz^-1 (mu_zd + g_zdd).

MaggiExplicitAdjoint::MaggiExplicitAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                           Objective objective)
    : MaggiAdjoint(std::move(mechanism), std::move(parameters), std::move(objective)) {
  add_rows("mu_z.", independent_names(), true);
  add_rows("mu_zd.", independent_names(), true);
  add_rows("mu_f.", assembly_.mechanism().state_names(), true);
  const int z = 0, zd = f_, f = 2 * f_;
  const SparsePattern If = SparsePattern::identity(f_), ff = full_pattern(f_, f_), fz = full_pattern(f_, nz_);
  block_.Dz = place(If, z, z);
  block_.Dzd = place(If, zd, zd);
  block_.Df = place(SparsePattern::identity(nz_), f, f);
  block_.z_zd = place(ff, z, zd);
  block_.z_f = place(fz, z, f);
  block_.zd_z = place(If, zd, z);
  block_.zd_zd = place(ff, zd, zd);
  block_.zd_f = place(fz, zd, f);
  block_.f_zd = place(full_pattern(nz_, f_), f, zd);
  block_.f_f = place(assembly_.state_state(), f, f, true);
  finalize();
}

void MaggiExplicitAdjoint::fill() {
  D_.add_constant(block_.Dz, 1);
  D_.add_constant(block_.Dzd, 1);
  D_.add_constant(block_.Df, 1);
  // K^T Mz^-1 = (Mz^-1 K)^T
  const Eigen::MatrixXd K = at_.solve_mass(at_.Kz).transpose(), C = at_.solve_mass(at_.Cz).transpose(),
                        Q = at_.solve_mass(at_.Qz).transpose(), Zq = at_.Zq.transpose(), Zv = at_.Zv.transpose();
  A_.add(block_.z_zd, K.data());
  A_.add(block_.z_f, Zq.data(), -1);
  A_.add_constant(block_.zd_z, -1);
  A_.add(block_.zd_zd, C.data());
  A_.add(block_.zd_f, Zv.data(), -1);
  A_.add(block_.f_zd, Q.data(), -1);
  A_.add(block_.f_f, assembly_.f_z.data(), -1);
  const MaggiBlocks::Reduced g = running();
  b_ = stacked(-g.z + K * g.zdd, -g.zd + C * g.zdd, -g.zf - Q * g.zdd);
}

Eigen::VectorXd MaggiExplicitAdjoint::join(const Adjoint& mu) { return stacked(mu.z, mu.zd, mu.f); }

MaggiAdjoint::Adjoint MaggiExplicitAdjoint::split(const Eigen::VectorXd& X) {
  return {X.head(f_), X.segment(f_, f_), force_states(X)};
}

Eigen::VectorXd MaggiExplicitAdjoint::multiplier(const Eigen::VectorXd& X) {
  return at_.solve_mass(X.segment(f_, f_) + running().zdd);
}

// Implicit form of first order: (5.7).

MaggiImplicitAdjoint::MaggiImplicitAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                           Objective objective)
    : MaggiAdjoint(std::move(mechanism), std::move(parameters), std::move(objective)) {
  add_rows("mu_z.", independent_names(), true);
  add_rows("mu.", independent_names(), true);
  add_rows("mu_f.", assembly_.mechanism().state_names(), true);
  const int z = 0, u = f_, f = 2 * f_;
  const SparsePattern If = SparsePattern::identity(f_), ff = full_pattern(f_, f_), fz = full_pattern(f_, nz_),
                      zxf = full_pattern(nz_, f_);
  block_.Dz = place(If, z, z);
  block_.DP = place(ff, u, u);
  block_.Df = place(SparsePattern::identity(nz_), f, f);
  block_.z_mu = place(ff, z, u, true);
  block_.z_f = place(zxf, z, f, true);
  block_.P_z = place(If, u, z);
  block_.P_mu = place(ff, u, u, true);
  block_.P_f = place(zxf, u, f, true);
  block_.f_mu = place(fz, f, u, true);
  block_.f_f = place(assembly_.state_state(), f, f, true);
  finalize();
}

void MaggiImplicitAdjoint::fill() {
  D_.add_constant(block_.Dz, 1);
  D_.add(block_.DP, at_.Mz.data());
  D_.add_constant(block_.Df, 1);
  A_.add(block_.z_mu, at_.Kz.data());
  A_.add(block_.z_f, at_.Zq.data(), -1);
  A_.add_constant(block_.P_z, -1);
  A_.add(block_.P_mu, at_.Cz.data());
  A_.add(block_.P_f, at_.Zv.data(), -1);
  A_.add(block_.f_mu, at_.Qz.data(), -1);
  A_.add(block_.f_f, assembly_.f_z.data(), -1);
  const MaggiBlocks::Reduced g = running();
  b_ = stacked(-g.z, -g.zd, -g.zf);
  d_.col(0).segment(f_, f_) = -g.zdd;
}

Eigen::VectorXd MaggiImplicitAdjoint::join(const Adjoint& mu) {
  return stacked(mu.z, at_.solve_mass(mu.zd + running().zdd), mu.f);
}

MaggiAdjoint::Adjoint MaggiImplicitAdjoint::split(const Eigen::VectorXd& X) {
  return {X.head(f_), at_.Mz * X.segment(f_, f_) - running().zdd, force_states(X)};
}

Eigen::VectorXd MaggiImplicitAdjoint::multiplier(const Eigen::VectorXd& X) { return X.segment(f_, f_); }

}  // namespace costate
