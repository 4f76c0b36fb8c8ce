#include "costate/adjoint/maggi_adjoint.h"

#include "costate/analysis/start.h"

namespace costate {

MaggiAdjoint::MaggiAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                           Objective objective)
    : MaggiEquations(std::move(mechanism), std::move(parameters), std::move(objective), Direction::backward) {}

// mu(T) = w in (y, yd, z), accelerations and multipliers eliminated (0.8).
void MaggiAdjoint::begin(Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  evaluate_parameters();
  const MaggiBlocks::Reduced w = at_.reduce_and_eliminate(terminal_gradient());
  gradient += w.rho;
  X = join({w.y, w.yd, w.z});
}

void MaggiAdjoint::integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) {
  evaluate_parameters();
  out = at_.reduce(running_gradient(), true).rho - at_.Fy.transpose() * multiplier(X.col(0)) +
        at_.Zr.transpose() * force_states(X.col(0));
}

void MaggiAdjoint::finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  evaluate_finish();
  const Eigen::MatrixXd Y = of_states(X);
  add_start_gradient(Y.data(), Y.data() + n_, Y.data() + 2 * n_, gradient);
  gradient += of_places_;
  begin_afresh();
}

// (5.12)
void MaggiAdjoint::change_chart(int to, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  const Eigen::MatrixXd Y = of_states(X);
  evaluate_in_chart(to);
  from_states(Y, X, gradient);
}

// The weights B^T mu_y of dq and B^T mu_yd of dv, and those of places by their rows.
Eigen::MatrixXd MaggiAdjoint::of_states(const Eigen::MatrixXd& X) {
  const Adjoint mu = split(X.col(0));
  const auto& independent = at_.independent();
  Eigen::MatrixXd Y = Eigen::MatrixXd::Zero(2 * n_ + nz_, 1);
  const auto free = static_cast<int>(independent.size());
  for (int i = 0; i < free; ++i) {
    Y(independent[static_cast<std::size_t>(i)], 0) = mu.y[i];
    Y(n_ + independent[static_cast<std::size_t>(i)], 0) = mu.yd[i];
  }
  Y.bottomRows(nz_) = mu.f;
  of_places_.setZero(assembly_.np());
  pull_places(assembly_, state(), at_.places(), mu.y.data() + free, Y.data(), of_places_.data());
  return Y;
}

// With (5.9): dq = R dy + Nr drho, dv = R dyd + D dy + Vr drho.
void MaggiAdjoint::from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  evaluate_parameters();
  const Eigen::VectorXd q = Y.col(0).head(n_), v = Y.col(0).segment(n_, n_);
  gradient += of_places_ + at_.Nr.transpose() * q + at_.Vr.transpose() * v;
  X = join({at_.Rp.transpose() * q + at_.D.transpose() * v, at_.R.transpose() * v, Y.col(0).tail(nz_)});
}

// Explicit form of first order: (5.5), with mu = My^-1 (mu_yd + g_ydd).

MaggiExplicitAdjoint::MaggiExplicitAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                           Objective objective)
    : MaggiAdjoint(std::move(mechanism), std::move(parameters), std::move(objective)) {
  add_rows("mu_y.", independent_names(), true);
  add_rows("mu_yd.", independent_names(), true);
  add_rows("mu_f.", assembly_.mechanism().state_names(), true);
  const int y = 0, yd = f_, f = 2 * f_;
  const SparsePattern If = SparsePattern::identity(f_), ff = full_pattern(f_, f_), fz = full_pattern(f_, nz_);
  block_.Dy = place(If, y, y);
  block_.Dyd = place(If, yd, yd);
  block_.Df = place(SparsePattern::identity(nz_), f, f);
  block_.y_yd = place(ff, y, yd);
  block_.y_f = place(fz, y, f);
  block_.yd_y = place(If, yd, y);
  block_.yd_yd = place(ff, yd, yd);
  block_.yd_f = place(fz, yd, f);
  block_.f_yd = place(full_pattern(nz_, f_), f, yd);
  block_.f_f = place(assembly_.state_state(), f, f, true);
  finalize();
}

void MaggiExplicitAdjoint::fill() {
  D_.add_constant(block_.Dy, 1);
  D_.add_constant(block_.Dyd, 1);
  D_.add_constant(block_.Df, 1);
  // K^T My^-1 = (My^-1 K)^T
  const Eigen::MatrixXd K = at_.solve_mass(at_.Ky).transpose(), C = at_.solve_mass(at_.Cy).transpose(),
                        Q = at_.solve_mass(at_.Qz).transpose(), Zq = at_.Zq.transpose(), Zv = at_.Zv.transpose();
  A_.add(block_.y_yd, K.data());
  A_.add(block_.y_f, Zq.data(), -1);
  A_.add_constant(block_.yd_y, -1);
  A_.add(block_.yd_yd, C.data());
  A_.add(block_.yd_f, Zv.data(), -1);
  A_.add(block_.f_yd, Q.data(), -1);
  A_.add(block_.f_f, assembly_.f_z.data(), -1);
  const MaggiBlocks::Reduced g = running();
  b_ = stacked(-g.y + K * g.ydd, -g.yd + C * g.ydd, -g.z - Q * g.ydd);
}

Eigen::VectorXd MaggiExplicitAdjoint::join(const Adjoint& mu) { return stacked(mu.y, mu.yd, mu.f); }

MaggiAdjoint::Adjoint MaggiExplicitAdjoint::split(const Eigen::VectorXd& X) {
  return {X.head(f_), X.segment(f_, f_), force_states(X)};
}

Eigen::VectorXd MaggiExplicitAdjoint::multiplier(const Eigen::VectorXd& X) {
  return at_.solve_mass_transposed(X.segment(f_, f_) + running().ydd);
}

// Implicit form of first order: (5.7).

MaggiImplicitAdjoint::MaggiImplicitAdjoint(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                           Objective objective)
    : MaggiAdjoint(std::move(mechanism), std::move(parameters), std::move(objective)) {
  add_rows("mu_y.", independent_names(), true);
  add_rows("mu.", independent_names(), true);
  add_rows("mu_f.", assembly_.mechanism().state_names(), true);
  const int y = 0, u = f_, f = 2 * f_;
  const SparsePattern If = SparsePattern::identity(f_), ff = full_pattern(f_, f_), fz = full_pattern(f_, nz_),
                      zxf = full_pattern(nz_, f_);
  block_.Dy = place(If, y, y);
  block_.DP = place(ff, u, u);
  block_.Df = place(SparsePattern::identity(nz_), f, f);
  block_.y_mu = place(ff, y, u, true);
  block_.y_f = place(zxf, y, f, true);
  block_.P_y = place(If, u, y);
  block_.P_mu = place(ff, u, u, true);
  block_.P_f = place(zxf, u, f, true);
  block_.f_mu = place(fz, f, u, true);
  block_.f_f = place(assembly_.state_state(), f, f, true);
  finalize();
}

void MaggiImplicitAdjoint::fill() {
  D_.add_constant(block_.Dy, 1);
  D_.add(block_.DP, at_.mass_transposed().data());
  D_.add_constant(block_.Df, 1);
  A_.add(block_.y_mu, at_.Ky.data());
  A_.add(block_.y_f, at_.Zq.data(), -1);
  A_.add_constant(block_.P_y, -1);
  A_.add(block_.P_mu, at_.Cy.data());
  A_.add(block_.P_f, at_.Zv.data(), -1);
  A_.add(block_.f_mu, at_.Qz.data(), -1);
  A_.add(block_.f_f, assembly_.f_z.data(), -1);
  const MaggiBlocks::Reduced g = running();
  b_ = stacked(-g.y, -g.yd, -g.z);
  d_.col(0).segment(f_, f_) = -g.ydd;
}

Eigen::VectorXd MaggiImplicitAdjoint::join(const Adjoint& mu) {
  return stacked(mu.y, at_.solve_mass_transposed(mu.yd + running().ydd), mu.f);
}

MaggiAdjoint::Adjoint MaggiImplicitAdjoint::split(const Eigen::VectorXd& X) {
  return {X.head(f_), at_.mass_transposed() * X.segment(f_, f_) - running().ydd, force_states(X)};
}

Eigen::VectorXd MaggiImplicitAdjoint::multiplier(const Eigen::VectorXd& X) { return X.segment(f_, f_); }

}  // namespace costate
