#include "costate/adjoint/maggi_second_order_adjoint.h"

#include "costate/adjoint/gradient_rate.h"
#include "costate/base/error.h"

namespace costate {

MaggiSecondOrderAdjoint::MaggiSecondOrderAdjoint(std::shared_ptr<const Mechanism> mechanism,
                                                 ParameterSelection parameters, Objective objective)
    : MaggiAdjoint(std::move(mechanism), std::move(parameters), std::move(objective)) {
  add_rows("mu.", independent_names(), true);
  add_rows("mu_dot.", independent_names(), true);
  add_rows("mu_f.", assembly_.mechanism().state_names(), true);
  const int u = 0, v = f_, f = 2 * f_;
  const SparsePattern If = SparsePattern::identity(f_), ff = full_pattern(f_, f_);
  block_.D_mu = place(If, u, u);
  block_.D_nu = place(ff, v, v);
  block_.D_f = place(SparsePattern::identity(nz_), f, f);
  block_.mu_nu = place(If, u, v);
  block_.nu_nu = place(ff, v, v);
  block_.nu_mu = place(ff, v, u);
  block_.nu_f = place(full_pattern(f_, nz_), v, f);
  block_.f_mu = place(full_pattern(f_, nz_), f, u, true);
  block_.f_f = place(assembly_.state_state(), f, f, true);
  if (may_slide_in_space(assembly_)) {
    block_.mu_mu = place(ff, u, u);
    block_.mu_y = place(ff, u, v);
    block_.mu_f = place(full_pattern(f_, nz_), u, f);
  }
  finalize();
}

void MaggiSecondOrderAdjoint::require_plain_cost() const {
  if (objective_.running_needs_accelerations())
    throw CapabilityError(
        "The second-order adjoint needs derivatives of the accelerations where the running cost depends "
        "on accelerations or reactions; use formulation 'maggi' or 'maggi-implicit' for this cost.");
}

std::vector<double> MaggiSecondOrderAdjoint::plan(const std::vector<double>& times, const Motion& motion) {
  require_plain_cost();
  kinks_ = find_force_kinks(assembly_, objective_, times, motion, jumps());
  first_.resize(static_cast<std::size_t>(2 * n_ + nz_));
  motion(times.front(), first_.data());
  std::vector<double> changes = MaggiAdjoint::plan(times, motion);
  append_times(kinks_, changes);
  return changes;
}

bool MaggiSecondOrderAdjoint::before_step(double t, double next, const double* qvz, Eigen::MatrixXd& X,
                                          Eigen::VectorXd& gradient) {
  const bool changed = MaggiAdjoint::before_step(t, next, qvz, X, gradient);
  const ForceKink* k = kink_before(kinks_, t);
  if (!k) return changed;
  evaluate(k->after, k->state_after.data());
  const Adjoint mu = split(X.col(0));
  evaluate(k->before, k->state_before.data());
  X = join(mu);
  return true;
}

void MaggiSecondOrderAdjoint::fill() {
  require_plain_cost();
  if (slips_in_space(assembly_)) return fill_slip_in_space();
  calc_path_rates(assembly_, state(), rates_);
  const SparsePattern& square = assembly_.square();
  at_.evaluate_rates();
  const Eigen::MatrixXd &R = at_.R, &R1 = at_.R1, &R2 = at_.R2, &Rr = at_.Rr, &Rr1 = at_.Rr1, &Rr2 = at_.Rr2;
  const Eigen::MatrixXd MR = times(square, assembly_.M, R), MR1 = times(square, assembly_.M, R1),
                        MR2 = times(square, assembly_.M, R2), M1R = times(square, rates_.M_dot, R),
                        M1R1 = times(square, rates_.M_dot, R1);
  My_dot_ = Rr1.transpose() * MR + Rr.transpose() * (M1R + MR1);
  const Eigen::MatrixXd My_ddot = Rr2.transpose() * MR + 2 * Rr1.transpose() * (M1R + MR1) +
                                  Rr.transpose() * (times(square, rates_.M_ddot, R) + 2 * M1R1 + MR2);
  const Eigen::MatrixXd Cy_dot =
      Rr1.transpose() * (times(square, assembly_.C, R) + 2 * MR1) +
      Rr.transpose() * (times(square, rates_.C_dot, R) + times(square, assembly_.C, R1) + 2 * M1R1 + 2 * MR2);
  Eigen::MatrixXd nu_mu = (Cy_dot - My_ddot - at_.Ky).transpose();
  const Eigen::MatrixXd nu_nu = (at_.Cy - My_dot_).transpose();
  const ScalarGradient& g = running_gradient();
  const MaggiBlocks::Reduced r = running();
  ScalarGradient rate;
  rate.resize(assembly_);
  calc_running_gradient_rate(objective_, assembly_, state(), rate);
  Eigen::VectorXd b = r.y - R1.transpose() * g.v - R.transpose() * rate.v;
  if (nz_ > 0) {
    // Zq^T mu_f - Zv'^T mu_f - Zv^T mu_f' with mu_f' = -g_z - Qz^T mu - f_z^T mu_f
    const SparsePattern& state_force = assembly_.state_force();
    const Eigen::MatrixXd Zv_dot = times(state_force, rates_.f_v_dot, R) + times(state_force, assembly_.f_v, R1);
    const Eigen::MatrixXd nu_f = (at_.Zq - Zv_dot + times(assembly_.state_state(), assembly_.f_z, at_.Zv)).transpose();
    A_.add(block_.nu_f, nu_f.data());
    nu_mu += at_.Zv.transpose() * at_.Qz.transpose();
    b += at_.Zv.transpose() * r.z;
    A_.add(block_.f_mu, at_.Qz.data(), -1);
    A_.add(block_.f_f, assembly_.f_z.data(), -1);
  }
  D_.add_constant(block_.D_mu, 1);
  D_.add(block_.D_nu, at_.mass_transposed().data());
  D_.add_constant(block_.D_f, 1);
  A_.add_constant(block_.mu_nu, 1);
  A_.add(block_.nu_nu, nu_nu.data());
  A_.add(block_.nu_mu, nu_mu.data());
  b_ = stacked(Eigen::VectorXd::Zero(f_), b, -r.z);
}

// X = (mu, mu_y, mu_f)
void MaggiSecondOrderAdjoint::fill_slip_in_space() {
  calc_path_rates(assembly_, state(), rates_);
  at_.evaluate_rates();
  const SparsePattern& square = assembly_.square();
  My_dot_ = at_.Rr1.transpose() * times(square, assembly_.M, at_.R) +
            at_.Rr.transpose() * (times(square, rates_.M_dot, at_.R) + times(square, assembly_.M, at_.R1));
  const auto inverse = [&](const Eigen::MatrixXd& x) { return at_.solve_mass_transposed(x); };
  const MaggiBlocks::Reduced r = running();
  const Eigen::MatrixXd mu_mu = inverse((at_.Cy - My_dot_).transpose()),
                        mu_y = -inverse(Eigen::MatrixXd::Identity(f_, f_)), mu_f = -inverse(at_.Zv.transpose()),
                        one = Eigen::MatrixXd::Identity(f_, f_), K = at_.Ky.transpose(), Zq = at_.Zq.transpose();
  D_.add_constant(block_.D_mu, 1);
  D_.add(block_.D_nu, one.data());
  D_.add_constant(block_.D_f, 1);
  A_.add(block_.mu_mu, mu_mu.data());
  A_.add(block_.mu_y, mu_y.data());
  A_.add(block_.mu_f, mu_f.data());
  A_.add(block_.nu_mu, K.data());
  A_.add(block_.nu_f, Zq.data(), -1);
  A_.add(block_.f_mu, at_.Qz.data(), -1);
  A_.add(block_.f_f, assembly_.f_z.data(), -1);
  b_ = stacked(-inverse(r.yd), -r.y, -r.z);
}

Eigen::VectorXd MaggiSecondOrderAdjoint::rest(const Eigen::VectorXd& mu, const Eigen::VectorXd& mu_f) {
  return -running().yd + at_.Cy.transpose() * mu - at_.Zv.transpose() * mu_f - My_dot_.transpose() * mu;
}

Eigen::VectorXd MaggiSecondOrderAdjoint::join(const Adjoint& mu) {
  const Eigen::VectorXd u = at_.solve_mass_transposed(mu.yd);
  if (slips_in_space(assembly_)) return stacked(u, mu.y, mu.f);
  return stacked(u, at_.solve_mass_transposed(rest(u, mu.f) - mu.y), mu.f);
}

MaggiAdjoint::Adjoint MaggiSecondOrderAdjoint::split(const Eigen::VectorXd& X) {
  const Eigen::VectorXd u = X.head(f_), mu_f = force_states(X);
  if (slips_in_space(assembly_)) return {X.segment(f_, f_), at_.mass_transposed() * u, mu_f};
  return {rest(u, mu_f) - at_.mass_transposed() * X.segment(f_, f_), at_.mass_transposed() * u, mu_f};
}

}  // namespace costate
