#include "costate/adjoint/maggi_tangent.h"

#include "costate/analysis/start.h"

namespace costate {

MaggiTangent::MaggiTangent(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                           Objective objective, Form form)
    : MaggiEquations(std::move(mechanism), std::move(parameters), std::move(objective), Direction::forward),
      form_(form) {
  add_rows("S.", independent_names(), true);
  add_rows("S.d/dt ", independent_names(), true);
  add_rows("S.", assembly_.mechanism().state_names(), true);
  const bool implicit = form == Form::implicit_form;
  if (implicit) add_rows("S.d2/dt2 ", independent_names(), false);
  const int z = 0, zd = f_, zf = 2 * f_, w = zf + nz_;
  const SparsePattern If = SparsePattern::identity(f_), ff = full_pattern(f_, f_), fz = full_pattern(f_, nz_),
                      zxf = full_pattern(nz_, f_);
  block_.Dz = place(If, z, z);
  block_.Dzd = place(If, zd, zd);
  block_.Dzf = place(SparsePattern::identity(nz_), zf, zf);
  block_.z_zd = place(If, z, zd);
  block_.zf_z = place(zxf, zf, z);
  block_.zf_zd = place(zxf, zf, zd);
  block_.zf_zf = place(assembly_.state_state(), zf, zf);
  const int row = implicit ? w : zd;  // of the equations of motion
  block_.w_z = place(ff, row, z);
  block_.w_zd = place(ff, row, zd);
  block_.w_zf = place(fz, row, zf);
  if (implicit) {
    block_.zd_w = place(If, zd, w);
    block_.w_w = place(ff, w, w);
  }
  finalize();
}

// (5.10); the explicit form is divided by Mz.
void MaggiTangent::fill() {
  evaluate_parameters();
  D_.add_constant(block_.Dz, 1);
  D_.add_constant(block_.Dzd, 1);
  D_.add_constant(block_.Dzf, 1);
  A_.add_constant(block_.z_zd, 1);
  A_.add(block_.zf_z, at_.Zq.data());
  A_.add(block_.zf_zd, at_.Zv.data());
  A_.add(block_.zf_zf, assembly_.f_z.data());
  b_.middleRows(2 * f_, nz_) = at_.Zr;
  if (form_ == Form::implicit_form) {
    A_.add_constant(block_.zd_w, 1);
    A_.add(block_.w_w, at_.Mz.data());
    A_.add(block_.w_z, at_.Kz.data());
    A_.add(block_.w_zd, at_.Cz.data());
    A_.add(block_.w_zf, at_.Qz.data(), -1);
    b_.bottomRows(f_) = at_.Fz;
  } else {
    A_.add(block_.w_z, at_.solve_mass(at_.Kz).eval().data(), -1);
    A_.add(block_.w_zd, at_.solve_mass(at_.Cz).eval().data(), -1);
    A_.add(block_.w_zf, at_.solve_mass(at_.Qz).eval().data());
    b_.middleRows(f_, f_) = -at_.solve_mass(at_.Fz);
  }
}

Eigen::MatrixXd MaggiTangent::accelerations(const Eigen::MatrixXd& X) {
  return -at_.solve_mass(at_.Kz * X.topRows(f_) + at_.Cz * X.middleRows(f_, f_) - at_.Qz * X.middleRows(2 * f_, nz_) +
                         at_.Fz);
}

void MaggiTangent::expand(const Eigen::MatrixXd& X) {
  evaluate_parameters();
  const auto Sz = X.topRows(f_), Szd = X.middleRows(f_, f_);
  dzf_ = X.middleRows(2 * f_, nz_);
  const Eigen::MatrixXd Szdd = form_ == Form::implicit_form ? Eigen::MatrixXd(X.bottomRows(f_)) : accelerations(X);
  dq_ = at_.R * Sz + at_.Nr;
  dv_ = at_.R * Szd + at_.D * Sz + at_.Vr;
  da_ = at_.R * Szdd + 2 * at_.D * Szd + at_.A * Sz + at_.Ar;
  dlambda_ = at_.multiplier_change(
      times(assembly_.square(), assembly_.M, da_) + times(assembly_.square(), assembly_.C, dv_) +
      times(assembly_.square(), assembly_.K, dq_) - times(assembly_.force_state(), assembly_.Q_z, dzf_) + at_.F);
}

Eigen::MatrixXd MaggiTangent::project(const Eigen::MatrixXd& dq, const Eigen::MatrixXd& dv,
                                      const Eigen::MatrixXd& dzf) {
  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(size(), columns());
  const auto& independent = at_.independent();
  for (int i = 0; i < f_; ++i) {
    X.row(i) = dq.row(independent[static_cast<std::size_t>(i)]);
    X.row(f_ + i) = dv.row(independent[static_cast<std::size_t>(i)]);
  }
  X.middleRows(2 * f_, nz_) = dzf;
  if (form_ == Form::implicit_form) {
    evaluate_parameters();
    X.bottomRows(f_) = accelerations(X);
  }
  return X;
}

void MaggiTangent::begin(Eigen::MatrixXd& X, Eigen::VectorXd&) {
  evaluate_start();
  const Start& s = start();
  X = project(s.q_rho, s.v_rho, s.z_rho);
}

Eigen::MatrixXd MaggiTangent::of_states(const Eigen::MatrixXd& X) {
  expand(X);
  Eigen::MatrixXd Y(2 * n_ + nz_, columns());
  Y << dq_, dv_, dzf_;
  return Y;
}

void MaggiTangent::from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd&) {
  X = project(Y.topRows(n_), Y.middleRows(n_, n_), Y.bottomRows(nz_));
}

void MaggiTangent::change_chart(int to, Eigen::MatrixXd& X, Eigen::VectorXd&) {
  expand(X);
  evaluate_in_chart(to);
  X = project(dq_, dv_, dzf_);
}

// The multipliers' share that only redundant rows have.
void MaggiTangent::add_null_terms(const ScalarGradient& g, Eigen::VectorXd& out) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(n_);
  at_.add_null_weight(g.lambda, q, out);
  out += dq_.transpose() * q;
}

void MaggiTangent::integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) {
  expand(X);
  add_running_tangent(dq_, dv_, dzf_, da_, dlambda_, out);
  add_null_terms(running_gradient(), out);
}

void MaggiTangent::finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  expand(X);
  add_terminal_tangent(dq_, dv_, dzf_, da_, dlambda_, gradient);
  add_null_terms(terminal_gradient(), gradient);
  begin_afresh();
}

}  // namespace costate
