// The derivatives of a static equilibrium with respect to the parameters, forward and adjoint: lib/README.md
// (0.10), (13.9).
#include "costate/analysis/picks.h"
#include "costate/analysis/redundant_parameters.h"
#include "costate/analysis/rest_system.h"
#include "costate/analysis/start.h"

namespace costate {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd RestSystem::lambda_off_range(const MatrixXd& q_rho) {
  // lambda = X w turns with X where rows are redundant: the part off the range of X is (1 - X X^+) X_rho w.
  VectorXd w(n_);
  for (const Part& p : parts_) put(p.linear.solve(pick(multipliers_, row_numbers(p))), p.q, w);
  StateView s = state();
  Assembly::ParameterColumns moved, still;
  assembly_.calc_parameter_columns(s, still);
  const std::vector<double> phid_q = assembly_.phid_q;
  s.v = w.data();
  assembly_.calc_dynamics(s);
  assembly_.calc_partials(s);
  assembly_.calc_parameter_columns(s, moved);
  MatrixXd out = MatrixXd::Zero(multipliers_.size(), q_rho.cols());
  for (const Part& p : parts_) {
    const auto rows = static_cast<Eigen::Index>(p.rows.size());
    MatrixXd d = MatrixXd::Zero(rows + static_cast<Eigen::Index>(p.held.size()), q_rho.cols());
    d.topRows(rows) = pick_rows(moved.phid - still.phid, p.rows) +
                      (part_of(assembly_.jacobian(), assembly_.phid_q, p.q, local_row_, p.rows.size()) -
                       part_of(assembly_.jacobian(), phid_q, p.q, local_row_, p.rows.size())) *
                          pick_rows(q_rho, p.q);
    put_rows(d - p.linear.matrix() * p.linear.solve(d), row_numbers(p), out);
  }
  return out;
}

void RestSystem::differentiate(MatrixXd& q_rho, MatrixXd& z_rho, MatrixXd& lambda_rho, MatrixXd& held_rho) {
  linearize();
  const int np = assembly_.np();
  if (np == 0) {
    for (const auto& [block, rows] : {std::pair{&q_rho, n_}, {&z_rho, nz_}, {&lambda_rho, m_}}) block->resize(rows, 0);
    held_rho.resize(static_cast<Eigen::Index>(held_.size()), 0);
    return;
  }
  Assembly::ParameterColumns c;
  assembly_.calc_parameter_columns(state(), c);
  const auto& columns = assembly_.number_columns();
  MatrixXd right = MatrixXd::Zero(multipliers_.size(), np);
  right.topRows(m_) = -c.phi;
  for (std::size_t h = 0; h < held_.size(); ++h)
    if (held_[h].number >= 0)
      for (const auto& [column, factor] : columns[static_cast<std::size_t>(held_[h].number)])
        right(m_ + static_cast<Eigen::Index>(h), column) += factor;
  VectorXd z0(nz_);
  calc_initial_states(assembly_, z0, &z_rho);
  q_rho.setZero(n_, np);
  MatrixXd multipliers = MatrixXd::Zero(multipliers_.size(), np);
  bool redundant = false;
  for (const Part& p : parts_) {
    const Eigen::Index f = p.N.cols(), nz = p.f_zz.rows();
    const MatrixXd change = pick_rows(right, row_numbers(p)), closing = p.linear.solve(change);
    if (p.linear.rank() < p.linear.matrix().rows())
      if (const auto [j, row] = torn_parameter(change, change - p.linear.matrix() * closing); j >= 0)
        refuse_torn_parameter(assembly_, j, row_numbers(p)[static_cast<std::size_t>(row)]);
    // Of held states the initial values; of free ones what follows.
    MatrixXd z = pick_rows(z_rho, p.states);
    for (const int i : p.free) z.row(i).setZero();
    const MatrixXd F = pick_rows(c.F, p.q);
    const std::vector<int> states = chosen(p.states, p.free);
    MatrixXd b(f + nz, np);
    b << -p.N.transpose() * (F - p.Q_z * z + p.K * closing), -(pick_rows(c.f, states) + p.f_z * z + p.f_q * closing);
    const MatrixXd x = solve_square(p.reduced(0), b), q = closing + p.N * x.topRows(f);
    for (Eigen::Index i = 0; i < nz; ++i) z.row(p.free[static_cast<std::size_t>(i)]) = x.row(f + i);
    put_rows(q, p.q, q_rho);
    put_rows(z, p.states, z_rho);
    put_rows(-p.linear.solve_transposed(F + p.K * q - p.Q_z * z), row_numbers(p), multipliers);
    redundant = redundant || p.linear.rank() < p.linear.matrix().rows();
  }
  if (redundant) multipliers += lambda_off_range(q_rho);
  lambda_rho = multipliers.topRows(m_);
  held_rho = multipliers.bottomRows(static_cast<Eigen::Index>(held_.size()));
}

void RestSystem::solve_adjoint(const VectorXd& weight_q, const VectorXd& weight_z, VectorXd& s, VectorXd& w,
                               VectorXd& x) const {
  s.setZero(n_);
  w.setZero(nz_);
  VectorXd rows = VectorXd::Zero(multipliers_.size());
  for (const Part& p : parts_) {
    const Eigen::Index f = p.N.cols(), nz = p.f_zz.rows();
    const VectorXd weight = pick(weight_q, p.q);
    const std::vector<int> states = chosen(p.states, p.free);
    VectorXd b(f + nz);
    b << p.N.transpose() * weight, pick(weight_z, states);
    const VectorXd solved = solve_square(p.reduced(0).transpose(), b), force = p.N * solved.head(f);
    put(force, p.q, s);
    put(solved.tail(nz), states, w);
    put(p.linear.solve_transposed(weight - p.K.transpose() * force - p.f_q.transpose() * solved.tail(nz)),
        row_numbers(p), rows);
  }
  x = rows.head(m_);
}

}  // namespace costate
