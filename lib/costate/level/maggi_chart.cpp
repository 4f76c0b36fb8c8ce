#include "costate/level/maggi_chart.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "costate/base/error.h"

namespace costate {

namespace {

SparsePattern selection_pattern(const std::vector<int>& independent, int n) {
  std::vector<std::pair<int, int>> entries;
  for (std::size_t k = 0; k < independent.size(); ++k) entries.emplace_back(static_cast<int>(k), independent[k]);
  return SparsePattern::from_entries(static_cast<int>(independent.size()), n, std::move(entries));
}

int matrix_size(const SparsePattern& jacobian, const std::vector<int>& independent) {
  const int rows = jacobian.rows + static_cast<int>(independent.size());
  return rows > jacobian.cols ? rows + jacobian.cols : rows;
}

}  // namespace

MaggiChart::MaggiChart(const SparsePattern& jacobian, std::vector<int> independent)
    : jacobian_(jacobian),
      independent_(std::move(independent)),
      n_(jacobian.cols),
      m_(jacobian.rows),
      f_(static_cast<int>(independent_.size())),
      selection_(selection_pattern(independent_, n_)),
      matrix_(matrix_size(jacobian, independent_)) {
  if (rows() < n_) throw Error("MaggiChart: fewer rows than coordinates.");
  if (redundant()) {
    identity_ = matrix_.place(SparsePattern::identity(rows()), 0, 0);
    jacobian_block_ = matrix_.place(jacobian_, 0, rows());
    selection_block_ = matrix_.place(selection_, m_, rows());
    transposed_jacobian_ = matrix_.place(jacobian_, rows(), 0, true);
    transposed_selection_ = matrix_.place(selection_, rows(), m_, true);
  } else {
    jacobian_block_ = matrix_.place(jacobian_, 0, 0);
    selection_block_ = matrix_.place(selection_, m_, 0);
  }
  matrix_.finalize();
  solver_ = std::make_unique<KluSolver>(matrix_.pattern());
  phi_q_.assign(jacobian.row.size(), 0);
  if (!redundant()) return;
  buffer_.assign(static_cast<std::size_t>(rows() + n_), 0);
  correction_ = buffer_;
}

bool MaggiChart::factor(const double* phi_q) {
  matrix_.set_zero();
  matrix_.add(jacobian_block_, phi_q);
  matrix_.add_constant(selection_block_, 1);
  if (redundant()) {
    matrix_.add(transposed_jacobian_, phi_q);
    matrix_.add_constant(transposed_selection_, 1);
    matrix_.add_constant(identity_, 1);
    std::copy(phi_q, phi_q + phi_q_.size(), phi_q_.begin());
  }
  return solver_->factor(matrix_.values().data()) < 0;
}

void MaggiChart::solve(double* b, int columns) {
  if (!redundant()) {
    solver_->solve(b, columns);
    return;
  }
  for (int j = 0; j < columns; ++j) solve_least_squares(b + static_cast<std::ptrdiff_t>(j) * rows());
}

// r = b - X x.
void MaggiChart::add_residual(const double* b, const double* x, double* r) const {
  std::copy(b, b + rows(), r);
  add_product(jacobian_, phi_q_.data(), -1, x, r);
  for (int k = 0; k < f_; ++k) r[m_ + k] -= x[independent_[k]];
}

// The augmented matrix squares the condition of X; one correction from the residual b - X x takes that back where b is
// consistent, as it is on the constraints.
void MaggiChart::solve_least_squares(double* b) {
  double *p = buffer_.data(), *x = p + rows(), *c = correction_.data();
  std::copy(b, b + rows(), p);
  std::fill(x, x + n_, 0.0);
  solver_->solve(p);
  add_residual(b, x, c);
  std::fill(c + rows(), c + rows() + n_, 0.0);
  solver_->solve(c);
  for (int i = 0; i < n_; ++i) b[i] = x[i] + c[rows() + i];
}

void MaggiChart::solve_transposed(double* x) {
  if (!redundant()) {
    solver_->solve_transposed(x);
    return;
  }
  // [[1, X], [X^T, 0]] [p; u] = [0; x]: p = X (X^T X)^-1 x, u = -(X^T X)^-1 x. Corrected once: X^T p = x.
  double *p = buffer_.data(), *u = p + rows(), *c = correction_.data(), *d = c + rows();
  std::fill(p, u, 0.0);
  std::copy(x, x + n_, u);
  solver_->solve(p);
  for (int i = 0; i < rows(); ++i) c[i] = -p[i];
  add_product(jacobian_, phi_q_.data(), -1, u, c);
  for (int k = 0; k < f_; ++k) c[m_ + k] -= u[independent_[k]];
  std::copy(x, x + n_, d);
  add_transposed_product(jacobian_, phi_q_.data(), -1, p, d);
  for (int k = 0; k < f_; ++k) d[independent_[k]] -= p[m_ + k];
  solver_->solve(c);
  for (int i = 0; i < rows(); ++i) x[i] = p[i] += c[i];
  for (int i = 0; i < n_; ++i) u[i] = -(u[i] + d[i]);
}

double worst_ratio(std::span<const int> independent, const double* R, const std::vector<double>& weight) {
  const std::size_t n = weight.size();
  double worst = 0;
  for (std::size_t j = 0; j < independent.size(); ++j, R += n) {
    double column = 0;
    for (std::size_t i = 0; i < n; ++i) column = std::max(column, std::abs(R[i]) * weight[i]);
    worst = std::max(worst, column / weight[static_cast<std::size_t>(independent[j])]);
  }
  return worst;
}

void improve_choice(std::vector<int>& independent, double* R, const std::vector<double>& weight) {
  constexpr double kSettled = 1 + 1e-6;  // ties are left as they are
  const auto n = static_cast<Eigen::Index>(weight.size()), f = static_cast<Eigen::Index>(independent.size());
  Eigen::Map<Eigen::MatrixXd> T(R, n, f);
  const auto weight_of = [&](Eigen::Index i) { return weight[i]; };
  for (Eigen::Index exchange = 0; exchange < 4 * n * f + 4; ++exchange) {
    double best = kSettled;
    Eigen::Index in = -1, out = -1;
    for (Eigen::Index j = 0; j < f; ++j)
      for (Eigen::Index i = 0; i < n; ++i) {
        const double ratio = std::abs(T(i, j)) * weight_of(i) / weight_of(independent[j]);
        if (ratio > best) {
          best = ratio;
          in = i;
          out = j;
        }
      }
    if (in < 0) return;
    // T := T P^-1 with P the rows of T at the new choice: column `out` over the pivot, out of row `in` elsewhere.
    const double pivot = T(in, out);
    T.col(out) /= pivot;
    for (Eigen::Index j = 0; j < f; ++j)
      if (j != out) T.col(j) -= T(in, j) * T.col(out);
    independent[out] = static_cast<int>(in);
  }
}

std::vector<int> choose_independent(const SparsePattern& jacobian, const double* phi_q, int freedoms,
                                    const std::vector<double>& weight) {
  const int n = jacobian.cols, m = jacobian.rows;
  std::vector<int> chosen;
  if (freedoms == 0) return chosen;
  // Weighted coordinates w_i q_i have the Jacobian Phi_q / w; its rows are brought to length 1.
  Eigen::MatrixXd Jt = Eigen::MatrixXd::Zero(n, m);
  for (int j = 0; j < n; ++j)
    for (auto k = jacobian.column_start[j]; k < jacobian.column_start[j + 1]; ++k)
      Jt(j, jacobian.row[k]) += phi_q[k] / weight[j];
  for (int i = 0; i < m; ++i) {
    const double norm = Jt.col(i).norm();
    if (norm > 0) Jt.col(i) /= norm;
  }
  Eigen::MatrixXd N;
  if (m > 0) {
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(Jt);
    N = Eigen::MatrixXd(qr.householderQ()).rightCols(freedoms);
  } else {
    N = Eigen::MatrixXd::Identity(n, n);
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> rows(N.transpose());
  Eigen::MatrixXd P(freedoms, freedoms);
  for (int k = 0; k < freedoms; ++k) {
    chosen.push_back(static_cast<int>(rows.colsPermutation().indices()[k]));
    P.row(k) = N.row(chosen.back());
  }
  Eigen::MatrixXd R = P.transpose().fullPivLu().solve(N.transpose()).transpose();
  // N is that of the weighted coordinates already.
  improve_choice(chosen, R.data(), std::vector<double>(static_cast<std::size_t>(n), 1.0));
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace costate
