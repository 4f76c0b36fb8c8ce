// The share of a static equilibrium in second derivatives (lib/README.md (13.7), (13.8)): with the balance
// R1 = Phi_q^T lambda - Q at v = a = 0 and f = 0 among the equations of the start, E gains -s^T R1 - w^T f.
#include "costate/adjoint/hessian_equations.h"
#include "costate/analysis/equilibrium.h"

namespace costate {

void HessianEquations::solve_balance_multipliers(const Start& start, const Eigen::VectorXd& weight_q,
                                                 const double* mu_z, double t, Eigen::VectorXd& x) {
  const EquilibriumAdjoint a =
      equilibrium_adjoint(assembly_, t, start.q, start.z, weight_q, Eigen::Map<const Eigen::VectorXd>(mu_z, nz_));
  balance_s_ = a.s;
  balance_w_ = a.w;
  x = a.x;
}

void HessianEquations::add_balance_change(double t, const Start& start, int k, const Eigen::VectorXd& dq,
                                          const Eigen::VectorXd& dz, Eigen::VectorXd& moved, double* rho) {
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(n_), dlambda = start.lambda_rho * directions_.col(k),
                        force = -balance_s_, state = -balance_w_;
  const StateView s{t, start.q.data(), rest.data(), rest.data(), start.lambda.data(), start.z.data()};
  Variation d;
  d.q = dq.data();
  d.v = d.a = rest.data();
  d.z = dz.data();
  d.lambda = dlambda.data();
  d.numbers = number_changes_[static_cast<std::size_t>(k)].data();
  TermWeights w;
  w.force = force.data();
  w.state = state.data();
  ScalarGradient change;
  change.resize(assembly_);
  add_gradient_change(
      assembly_, s, d, w,
      {change.q.data(), change.v.data(), change.a.data(), change.lambda.data(), change.z.data(), change.rho.data()});
  moved.head(n_) += change.q;
  moved.tail(nz_) += change.z;
  const Eigen::VectorXd sum = change.rho + start.lambda_rho.transpose() * change.lambda;
  for (int j = 0; j < parameter_count(); ++j) rho[j] += sum[j];
}

}  // namespace costate
