#include "costate/level/maggi_chart.h"

#include <algorithm>

#include "costate/base/error.h"

namespace costate {

namespace {

SparsePattern selection_pattern(const std::vector<int>& independent, int n) {
  std::vector<std::pair<int, int>> entries;
  for (std::size_t k = 0; k < independent.size(); ++k) entries.emplace_back(static_cast<int>(k), independent[k]);
  return SparsePattern::from_entries(static_cast<int>(independent.size()), n, std::move(entries));
}

// Of the rows that are not there: one unknown each.
SparsePattern absent_pattern(const std::vector<int>& absent, int rows) {
  std::vector<std::pair<int, int>> entries;
  for (std::size_t k = 0; k < absent.size(); ++k) entries.emplace_back(absent[k], static_cast<int>(k));
  return SparsePattern::from_entries(rows, static_cast<int>(absent.size()), std::move(entries));
}

int matrix_size(const SparsePattern& jacobian, const std::vector<int>& independent, const std::vector<int>& absent) {
  const int rows = jacobian.rows + static_cast<int>(independent.size());
  return rows > jacobian.cols + static_cast<int>(absent.size()) ? rows + jacobian.cols : rows;
}

}  // namespace

MaggiChart::MaggiChart(const SparsePattern& jacobian, std::vector<int> independent, std::vector<int> absent, int places)
    : jacobian_(jacobian),
      independent_(std::move(independent)),
      absent_(std::move(absent)),
      n_(jacobian.cols),
      m_(jacobian.rows),
      f_(static_cast<int>(independent_.size())),
      places_(places),
      selection_(selection_pattern(independent_, n_)),
      matrix_(matrix_size(jacobian, independent_, absent_)) {
  const int all = m_ + f_;
  if (all < n_ + static_cast<int>(absent_.size())) throw Error("MaggiChart: fewer rows than coordinates.");
  if (redundant()) {
    identity_ = matrix_.place(SparsePattern::identity(all), 0, 0);
    jacobian_block_ = matrix_.place(jacobian_, 0, all);
    selection_block_ = matrix_.place(selection_, m_, all);
    transposed_jacobian_ = matrix_.place(jacobian_, all, 0, true);
    transposed_selection_ = matrix_.place(selection_, all, m_, true);
  } else {
    jacobian_block_ = matrix_.place(jacobian_, 0, 0);
    selection_block_ = matrix_.place(selection_, m_, 0);
    if (!absent_.empty()) absent_block_ = matrix_.place(absent_pattern(absent_, m_), 0, n_);
  }
  matrix_.finalize();
  solver_ = std::make_unique<KluSolver>(matrix_.pattern());
  phi_q_.assign(jacobian.row.size(), 0);
  if (!redundant()) return;
  buffer_.assign(static_cast<std::size_t>(all + n_), 0);
  correction_ = buffer_;
}

bool MaggiChart::factor(const double* phi_q) {
  matrix_.set_zero();
  matrix_.add(jacobian_block_, phi_q);
  matrix_.add_constant(selection_block_, 1);
  if (absent_block_ >= 0) matrix_.add_constant(absent_block_, 1);
  if (redundant()) {
    matrix_.add(transposed_jacobian_, phi_q);
    matrix_.add_constant(transposed_selection_, 1);
    matrix_.add_constant(identity_, 1);
    std::copy(phi_q, phi_q + phi_q_.size(), phi_q_.begin());
  }
  return solver_->factor(matrix_.values().data()) < 0;
}

void MaggiChart::solve(double* b, int columns) {
  if (!redundant() && places_ == 0) {
    solver_->solve(b, columns);
    return;
  }
  if (!redundant()) {
    for (int j = 0; j < columns; ++j) solver_->solve(b + static_cast<std::ptrdiff_t>(j) * rows());
    return;
  }
  for (int j = 0; j < columns; ++j) solve_least_squares(b + static_cast<std::ptrdiff_t>(j) * rows());
}

// r = b - X x.
void MaggiChart::add_residual(const double* b, const double* x, double* r) const {
  std::copy(b, b + m_ + f_, r);
  add_product(jacobian_, phi_q_.data(), -1, x, r);
  for (int k = 0; k < f_; ++k) r[m_ + k] -= x[independent_[k]];
}

// The augmented matrix squares the condition of X; one correction from the residual b - X x takes that back where b is
// consistent, as it is on the constraints.
void MaggiChart::solve_least_squares(double* b) {
  double *p = buffer_.data(), *x = p + m_ + f_, *c = correction_.data();
  std::copy(b, b + m_ + f_, p);
  std::fill(x, x + n_, 0.0);
  solver_->solve(p);
  add_residual(b, x, c);
  std::fill(c + m_ + f_, c + m_ + f_ + n_, 0.0);
  solver_->solve(c);
  for (int i = 0; i < n_; ++i) b[i] = x[i] + c[m_ + f_ + i];
}

void MaggiChart::solve_transposed(double* x) {
  std::fill(x + m_ + f_, x + rows(), 0.0);  // places move nothing
  if (!redundant()) {
    std::fill(x + n_, x + n_ + absent_.size(), 0.0);
    solver_->solve_transposed(x);
    return;
  }
  // [[1, X], [X^T, 0]] [p; u] = [0; x]: p = X (X^T X)^-1 x, u = -(X^T X)^-1 x. Corrected once: X^T p = x.
  double *p = buffer_.data(), *u = p + m_ + f_, *c = correction_.data(), *d = c + m_ + f_;
  std::fill(p, u, 0.0);
  std::copy(x, x + n_, u);
  solver_->solve(p);
  for (int i = 0; i < m_ + f_; ++i) c[i] = -p[i];
  add_product(jacobian_, phi_q_.data(), -1, u, c);
  for (int k = 0; k < f_; ++k) c[m_ + k] -= u[independent_[k]];
  std::copy(x, x + n_, d);
  add_transposed_product(jacobian_, phi_q_.data(), -1, p, d);
  for (int k = 0; k < f_; ++k) d[independent_[k]] -= p[m_ + k];
  solver_->solve(c);
  for (int i = 0; i < m_ + f_; ++i) x[i] = p[i] += c[i];
  for (int i = 0; i < n_; ++i) u[i] = -(u[i] + d[i]);
}

}  // namespace costate
