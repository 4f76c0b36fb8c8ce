#include "costate/discrete/stage_matrix.h"

#include <cmath>

namespace costate {

StageMatrix::StageMatrix(const RadauScheme& scheme, const SparsePattern& jacobian, std::vector<char> differential)
    : scheme_(scheme), pattern_(jacobian), differential_(std::move(differential)), n_(jacobian.cols) {
  const auto n = static_cast<std::size_t>(n_), s = static_cast<std::size_t>(scheme.stages);
  for (int i = 0; i < n_; ++i)
    if (differential_[static_cast<std::size_t>(i)]) diagonal_.push_back(jacobian.find(i, i));
  real_ = std::make_unique<KluSolver>(jacobian);
  for (const auto& shift : scheme.shift)
    if (shift.imag() != 0) complex_.emplace_back(jacobian);
  row_scale_.assign(n, 1);
  col_scale_.assign(n, 1);
  scaled_.assign(jacobian.row.size(), 0);
  values_ = scaled_;
  complex_values_.assign(scaled_.size(), 0);
  right_.assign(n, 0);
  complex_right_.assign(n, 0);
  parts_.assign(n * s, 0);
}

long StageMatrix::factorizations() const {
  long sum = real_->counters().factorizations;
  for (const auto& c : complex_) sum += c.factorizations();
  return sum;
}

int StageMatrix::factor_real(double shift, KluSolver& solver) {
  values_ = scaled_;
  std::size_t at = 0;
  for (int i = 0; i < n_; ++i)
    if (differential_[static_cast<std::size_t>(i)])
      values_[static_cast<std::size_t>(diagonal_[at++])] += shift * col_scale_[static_cast<std::size_t>(i)];
  return solver.factor(values_.data());
}

int StageMatrix::factor(const double* J, double h) {
  h_ = h;
  filter_ready_ = has_real();
  const double size = std::abs(scheme_.shift.front());
  for (int i = 0; i < n_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    row_scale_[k] = differential_[k] ? h : 1;
  }
  for (int j = 0; j < n_; ++j) {
    const auto column = static_cast<std::size_t>(j);
    double largest = differential_[column] ? size : 0;
    for (auto e = pattern_.column_start[column]; e < pattern_.column_start[column + 1]; ++e) {
      const auto k = static_cast<std::size_t>(e);
      scaled_[k] = row_scale_[static_cast<std::size_t>(pattern_.row[k])] * J[k];
      largest = std::max(largest, std::abs(scaled_[k]));
    }
    col_scale_[column] = largest > 0 ? 1 / largest : 1;
    for (auto e = pattern_.column_start[column]; e < pattern_.column_start[column + 1]; ++e)
      scaled_[static_cast<std::size_t>(e)] *= col_scale_[column];
  }
  if (has_real())
    if (const int bad = factor_real(scheme_.shift.front().real(), *real_); bad >= 0) return bad;
  std::size_t pair = 0;
  for (const auto& shift : scheme_.shift) {
    if (shift.imag() == 0) continue;
    std::copy(scaled_.begin(), scaled_.end(), complex_values_.begin());
    std::size_t at = 0;
    for (int i = 0; i < n_; ++i)
      if (differential_[static_cast<std::size_t>(i)])
        complex_values_[static_cast<std::size_t>(diagonal_[at++])] += shift * col_scale_[static_cast<std::size_t>(i)];
    if (const int bad = complex_[pair++].factor(complex_values_.data()); bad >= 0) return bad;
  }
  return -1;
}

void StageMatrix::solve_apart(double* x, bool transposed) {
  const int s = scheme_.stages;
  const auto n = static_cast<std::size_t>(n_);
  // (R A C)^-1 with R, C the scales: A^-1 = C (.)^-1 R, and transposed R (.)^-T C.
  const std::vector<double>&before = transposed ? col_scale_ : row_scale_,
        &after = transposed ? row_scale_ : col_scale_;
  std::fill(parts_.begin(), parts_.end(), 0.0);
  std::size_t pair = 0;
  for (std::size_t k = 0; k < scheme_.shift.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    const auto in = [&](int i) { return transposed ? scheme_.t(i, column) : scheme_.t_inverse(column, i); };
    const auto out = [&](int i) { return transposed ? scheme_.t_inverse(column, i) : scheme_.t(i, column); };
    if (scheme_.shift[k].imag() == 0) {
      std::fill(right_.begin(), right_.end(), 0.0);
      for (int i = 0; i < s; ++i) {
        const double factor = in(i).real();
        const double* xi = x + static_cast<std::size_t>(i) * n;
        for (std::size_t e = 0; e < n; ++e) right_[e] += factor * xi[e];
      }
      for (std::size_t e = 0; e < n; ++e) right_[e] *= before[e];
      if (transposed)
        real_->solve_transposed(right_.data());
      else
        real_->solve(right_.data());
      for (int i = 0; i < s; ++i) {
        const double factor = out(i).real();
        double* to = parts_.data() + static_cast<std::size_t>(i) * n;
        for (std::size_t e = 0; e < n; ++e) to[e] += factor * right_[e];
      }
      continue;
    }
    std::fill(complex_right_.begin(), complex_right_.end(), 0.0);
    for (int i = 0; i < s; ++i) {
      const std::complex<double> factor = in(i);
      const double* xi = x + static_cast<std::size_t>(i) * n;
      for (std::size_t e = 0; e < n; ++e) complex_right_[e] += factor * xi[e];
    }
    for (std::size_t e = 0; e < n; ++e) complex_right_[e] *= before[e];
    if (transposed)
      complex_[pair].solve_transposed(complex_right_.data());
    else
      complex_[pair].solve(complex_right_.data());
    ++pair;
    // The conjugate gives the conjugate.
    for (int i = 0; i < s; ++i) {
      const double re = 2 * out(i).real(), im = 2 * out(i).imag();
      double* to = parts_.data() + static_cast<std::size_t>(i) * n;
      for (std::size_t e = 0; e < n; ++e) to[e] += re * complex_right_[e].real() - im * complex_right_[e].imag();
    }
  }
  for (int i = 0; i < s; ++i)
    for (std::size_t e = 0; e < n; ++e)
      x[static_cast<std::size_t>(i) * n + e] = after[e] * parts_[static_cast<std::size_t>(i) * n + e];
}

void StageMatrix::solve(double* x) { solve_apart(x, false); }
void StageMatrix::solve_transposed(double* x) { solve_apart(x, true); }

void StageMatrix::filter(double* x) {
  // Regular as those of the stages are.
  if (!filter_ready_) filter_ready_ = factor_real(scheme_.filter, *real_) < 0;
  const auto n = static_cast<std::size_t>(n_);
  for (std::size_t e = 0; e < n; ++e) x[e] *= row_scale_[e];
  real_->solve(x);
  for (std::size_t e = 0; e < n; ++e) x[e] *= col_scale_[e];
}

}  // namespace costate
