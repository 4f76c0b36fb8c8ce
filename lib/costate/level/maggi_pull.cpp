// The transposed half of MaggiLevel: the gradient of L = g - sigma^T R1 + mu_f^T f (lib/README.md (5)).
#include <algorithm>

#include "costate/level/maggi_level.h"

namespace costate {

void MaggiLevel::pull(const ScalarGradient& g, bool with_multipliers) {
  std::copy_n(g.q.data(), n_, g_q_.begin());
  std::copy_n(g.v.data(), n_, g_v_.begin());
  std::copy_n(g.a.data(), n_, g_a_.begin());
  std::copy_n(g.z.data(), nz_, g_z_.begin());
  std::fill(s1_.begin(), s1_.end(), 0.0);
  std::fill(along_.begin(), along_.end(), 0.0);
  weighs_null_ = false;
  if (!with_multipliers) return;
  // dlambda = -S^T (M da + C dv + K dq - Q_z dz + F_rho drho): a force weight S g_lambda^T.
  MaggiChart& X = positions_.reaction_chart();
  std::copy_n(g.lambda.data(), m_, s1_.begin());
  for (const Assembly::SlidingRow& r : assembly_.sliding_rows()) along_[r.along] = g.lambda[r.along];
  // dlambda_k = -mu sigma_k dlambda_n + (R2_k)_q dq + (R2_k)_v dv
  if (!slip_q_.empty()) {
    add_transposed_product(assembly_.jacobian(), slip_q_.data(), 1, along_.data(), g_q_.data());
    add_transposed_product(assembly_.jacobian(), slip_v_.data(), 1, along_.data(), g_v_.data());
  }
  pull_friction_multipliers(assembly_, s1_.data());
  X.solve(s1_.data());
  std::fill(s1_.begin() + n_, s1_.end(), 0.0);
  if (!X.redundant()) return;
  // The least norm moves with the range of Phi_q: dlambda gains -(1 - Phi_q S) dPhi_q (X^T X)^-1 h, h = M a - Q.
  std::copy_n(g.lambda.data(), m_, null_weight_.begin());
  add_product(assembly_.jacobian(), assembly_.phi_q.data(), -1, s1_.data(), null_weight_.data());
  weighs_null_ = std::any_of(null_weight_.begin(), null_weight_.end(), [](double x) { return x != 0; });
}

void MaggiLevel::add_force_weight(const double* x) {
  // R_r x without R_r.
  std::fill(work_.begin(), work_.end(), 0.0);
  std::copy_n(x, f_, work_.begin() + m_);
  positions_.reaction_chart().solve(work_.data());
  for (int i = 0; i < n_; ++i) s1_[i] += work_[i];
}

void MaggiLevel::eliminate_accelerations(const double* mu, double* x) {
  // L_w = R^T (g_a - M s1)
  std::copy(g_a_.begin(), g_a_.end(), work_.begin());
  add_product(assembly_.square(), assembly_.M.data(), -1, s1_.data(), work_.data());
  double* weight = reaction_a_.data();
  mass_.project_rates(work_.data(), weight);
  if (mu)
    for (int j = 0; j < f_; ++j) weight[j] += mu[j];
  mass_.solve_transposed(point_.t(), weight);
  if (x) std::copy_n(weight, f_, x);
  mass_.expand_forces(weight, work_.data());
  for (int i = 0; i < n_; ++i) s1_[i] += work_[i];
}

void MaggiLevel::finish_pull(const double* mu_f) {
  MaggiChart& X = positions_.chart();
  const SparsePattern &rows = assembly_.jacobian(), &square = assembly_.square();
  mu_f_ = nz_ > 0 ? mu_f : nullptr;
  // Weights of da, dv and dq in turn; each passes -S^T of itself on to those before it.
  std::copy(g_a_.begin(), g_a_.end(), reaction_a_.begin());
  add_product(square, assembly_.M.data(), -1, s1_.data(), reaction_a_.data());
  X.solve_transposed(reaction_a_.data());

  std::copy(g_v_.begin(), g_v_.end(), reaction_v_.begin());
  add_transposed_product(square, assembly_.C.data(), -1, s1_.data(), reaction_v_.data());
  add_transposed_product(rows, assembly_.phid_q.data(), -2, reaction_a_.data(), reaction_v_.data());
  if (mu_f_) add_transposed_product(assembly_.state_force(), assembly_.f_v.data(), 1, mu_f_, reaction_v_.data());
  X.solve_transposed(reaction_v_.data());

  std::copy(g_q_.begin(), g_q_.end(), reaction_q_.begin());
  add_transposed_product(square, assembly_.K.data(), -1, s1_.data(), reaction_q_.data());
  add_transposed_product(rows, assembly_.phidd_q.data(), -1, reaction_a_.data(), reaction_q_.data());
  add_transposed_product(rows, assembly_.phid_q.data(), -1, reaction_v_.data(), reaction_q_.data());
  if (mu_f_) add_transposed_product(assembly_.state_force(), assembly_.f_q.data(), 1, mu_f_, reaction_q_.data());
  if (weighs_null_) {
    // null_weight^T (Phi_q u)_q = u^T (Phi_q^T null_weight)_q
    assembly_.calc_hessian(state(), null_weight_.data(), hessian_);
    add_transposed_product(square, hessian_.data(), -1, normal_.data(), reaction_q_.data());
  }
  X.solve_transposed(reaction_q_.data());
  pull_to_places();

  if (nz_ == 0) return;
  add_transposed_product(assembly_.force_state(), assembly_.Q_z.data(), 1, s1_.data(), g_z_.data());
  if (mu_f_) add_transposed_product(assembly_.state_state(), assembly_.f_z.data(), 1, mu_f_, g_z_.data());
}

void MaggiLevel::pull_to_places() {
  const auto free = independent().size();
  for (std::size_t k = 0; k < places().size(); ++k) {
    const int row = places()[k];
    if (!assembly_.holds_position(row))
      reaction_q_[static_cast<std::size_t>(m_) + free + k] = reaction_q_[static_cast<std::size_t>(row)];
  }
}

void MaggiLevel::add_pulled_parameters(double c, double* gradient) {
  Assembly::ParameterWeights w;
  w.force = s1_.data();
  if (slides()) {
    // What weighs lambda_t weighs mu: dlambda_t = R2_rho of the row at fixed lambda_n.
    std::vector<double> force(static_cast<std::size_t>(m_), 0);
    add_product(assembly_.jacobian(), assembly_.reaction_jacobian().data(), 1, s1_.data(), force.data());
    for (const Assembly::SlidingRow& r : assembly_.sliding_rows())
      reaction_a_[r.along] = force[static_cast<std::size_t>(r.along)] - along_[r.along];
  }
  w.row = reaction_a_.data();
  w.c2 = 1;
  w.row_phid = reaction_v_.data();
  w.row_phi = reaction_q_.data();
  w.state = mu_f_;
  assembly_.add_parameter_gradient(state(), w, -c, gradient);
  if (!weighs_null_) return;
  // (Phi_q u)_rho = Phid_rho at v = u less that at v = 0.
  Assembly::ParameterWeights null;
  null.row_phid = null_weight_.data();
  StateView s = state();
  s.v = normal_.data();
  assembly_.add_parameter_gradient(s, null, -c, gradient);
  s.v = zero_.data();
  assembly_.add_parameter_gradient(s, null, c, gradient);
}

}  // namespace costate
