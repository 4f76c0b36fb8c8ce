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
  const int y = 0, yd = f_, z = 2 * f_, w = z + nz_;
  const SparsePattern If = SparsePattern::identity(f_), ff = full_pattern(f_, f_), fz = full_pattern(f_, nz_),
                      zxf = full_pattern(nz_, f_);
  block_.Dy = place(If, y, y);
  block_.Dyd = place(If, yd, yd);
  block_.Dz = place(SparsePattern::identity(nz_), z, z);
  block_.y_yd = place(If, y, yd);
  block_.z_y = place(zxf, z, y);
  block_.z_yd = place(zxf, z, yd);
  block_.z_z = place(assembly_.state_state(), z, z);
  const int row = implicit ? w : yd;  // of the equations of motion
  block_.w_y = place(ff, row, y);
  block_.w_yd = place(ff, row, yd);
  block_.w_z = place(fz, row, z);
  if (implicit) {
    block_.yd_w = place(If, yd, w);
    block_.w_w = place(ff, w, w);
  }
  finalize();
}

// (5.10); the explicit form is divided by My.
void MaggiTangent::fill() {
  evaluate_parameters();
  D_.add_constant(block_.Dy, 1);
  D_.add_constant(block_.Dyd, 1);
  D_.add_constant(block_.Dz, 1);
  A_.add_constant(block_.y_yd, 1);
  A_.add(block_.z_y, at_.Zq.data());
  A_.add(block_.z_yd, at_.Zv.data());
  A_.add(block_.z_z, assembly_.f_z.data());
  b_.middleRows(2 * f_, nz_) = at_.Zr;
  if (form_ == Form::implicit_form) {
    A_.add_constant(block_.yd_w, 1);
    A_.add(block_.w_w, at_.My.data());
    A_.add(block_.w_y, at_.Ky.data());
    A_.add(block_.w_yd, at_.Cy.data());
    A_.add(block_.w_z, at_.Qz.data(), -1);
    b_.bottomRows(f_) = at_.Fy;
  } else {
    A_.add(block_.w_y, at_.solve_mass(at_.Ky).eval().data(), -1);
    A_.add(block_.w_yd, at_.solve_mass(at_.Cy).eval().data(), -1);
    A_.add(block_.w_z, at_.solve_mass(at_.Qz).eval().data());
    b_.middleRows(f_, f_) = -at_.solve_mass(at_.Fy);
  }
}

Eigen::MatrixXd MaggiTangent::accelerations(const Eigen::MatrixXd& X) {
  return -at_.solve_mass(at_.Ky * X.topRows(f_) + at_.Cy * X.middleRows(f_, f_) - at_.Qz * X.middleRows(2 * f_, nz_) +
                         at_.Fy);
}

void MaggiTangent::expand(const Eigen::MatrixXd& X) {
  evaluate_parameters();
  const auto Sy = X.topRows(f_), Syd = X.middleRows(f_, f_);
  dz_ = X.middleRows(2 * f_, nz_);
  const Eigen::MatrixXd Sydd = form_ == Form::implicit_form ? Eigen::MatrixXd(X.bottomRows(f_)) : accelerations(X);
  dq_ = at_.Rp * Sy + at_.Nr;
  dv_ = at_.R * Syd + at_.D * Sy + at_.Vr;
  da_ = at_.R * Sydd + at_.E * Syd + at_.A * Sy + at_.Ar;
  dlambda_ = at_.multiplier_change(
      times(assembly_.square(), assembly_.M, da_) + times(assembly_.square(), assembly_.C, dv_) +
      times(assembly_.square(), assembly_.K, dq_) - times(assembly_.force_state(), assembly_.Q_z, dz_) + at_.F);
  dlambda_ += at_.friction_change(dq_, dv_);
}

Eigen::MatrixXd MaggiTangent::project(const Eigen::MatrixXd& dq, const Eigen::MatrixXd& dv, const Eigen::MatrixXd& dz) {
  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(size(), columns());
  const auto& independent = at_.independent();
  const auto free = static_cast<int>(independent.size());
  for (int i = 0; i < free; ++i) {
    X.row(i) = dq.row(independent[static_cast<std::size_t>(i)]);
    X.row(f_ + i) = dv.row(independent[static_cast<std::size_t>(i)]);
  }
  std::vector<const double*> from;
  std::vector<double*> to;
  for (Eigen::Index j = 0; j < X.cols(); ++j) {
    from.push_back(dq.col(j).data());
    to.push_back(X.col(j).data() + free);
  }
  push_places(assembly_, state(), at_.places(), from.data(), to.data(), static_cast<int>(X.cols()));
  X.middleRows(2 * f_, nz_) = dz;
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
  Y << dq_, dv_, dz_;
  return Y;
}

void MaggiTangent::from_states(const Eigen::MatrixXd& Y, Eigen::MatrixXd& X, Eigen::VectorXd&) {
  X = project(Y.topRows(n_), Y.middleRows(n_, n_), Y.bottomRows(nz_));
}

void MaggiTangent::change_chart(int to, Eigen::MatrixXd& X, Eigen::VectorXd&) {
  expand(X);
  evaluate_in_chart(to);
  X = project(dq_, dv_, dz_);
}

// The multipliers' share that only redundant rows have.
void MaggiTangent::add_null_terms(const ScalarGradient& g, Eigen::VectorXd& out) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(n_);
  at_.add_null_weight(g.lambda, q, out);
  out += dq_.transpose() * q;
}

void MaggiTangent::integrand(const Eigen::MatrixXd& X, Eigen::VectorXd& out) {
  expand(X);
  add_running_tangent(dq_, dv_, dz_, da_, dlambda_, out);
  add_null_terms(running_gradient(), out);
}

void MaggiTangent::finish(const Eigen::MatrixXd& X, Eigen::VectorXd& gradient) {
  expand(X);
  add_terminal_tangent(dq_, dv_, dz_, da_, dlambda_, gradient);
  add_null_terms(terminal_gradient(), gradient);
  begin_afresh();
}

}  // namespace costate
