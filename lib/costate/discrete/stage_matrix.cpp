#include "costate/discrete/stage_matrix.h"

#include <cmath>

#include "costate/base/error.h"

namespace costate {

namespace {
constexpr int kStagePivotOrders = 8;  // whose factors can be brought back
}

StageMatrix::StageMatrix(const RadauScheme& scheme, const SparsePattern& jacobian, std::vector<char> differential)
    : scheme_(scheme), pattern_(jacobian), differential_(std::move(differential)), n_(jacobian.cols) {
  const auto n = static_cast<std::size_t>(n_), s = static_cast<std::size_t>(scheme.stages);
  for (int i = 0; i < n_; ++i)
    if (differential_[static_cast<std::size_t>(i)]) diagonal_.push_back(jacobian.find(i, i));
  real_ = std::make_unique<KluSolver>(jacobian);
  for (const auto& shift : scheme.shift)
    if (shift.imag() != 0) complex_.emplace_back(jacobian);
  real_->keep_pivot_orders(kStagePivotOrders);
  for (auto& c : complex_) c.keep_pivot_orders(kStagePivotOrders);
  row_scale_.assign(n, 1);
  col_scale_.assign(n, 1);
  scaled_.assign(jacobian.row.size(), 0);
  values_ = scaled_;
  complex_values_.assign(scaled_.size(), 0);
  complex_right_.assign(n, 0);
  parts_.assign(n * s, 0);
}

long StageMatrix::factorizations() const {
  long sum = real_->counters().factorizations;
  for (const auto& c : complex_) sum += c.factorizations();
  return sum;
}

// The step, the pivot orders, the scales of columns, and the factors.
std::size_t StageMatrix::saved_size() const {
  std::size_t sum = 2 + complex_.size() + col_scale_.size() + (has_real() ? real_->saved_size() : 0);
  for (const auto& c : complex_) sum += c.saved_size();
  return sum;
}

void StageMatrix::save(double* to) const {
  *to++ = h_;
  *to++ = has_real() ? static_cast<double>(real_->pivot_order()) : 0;
  for (const auto& c : complex_) *to++ = static_cast<double>(c.pivot_order());
  to = std::copy(col_scale_.begin(), col_scale_.end(), to);
  if (has_real()) {
    real_->save(to);
    to += real_->saved_size();
  }
  for (const auto& c : complex_) {
    c.save(to);
    to += c.saved_size();
  }
}

bool StageMatrix::restore(const double* from) {
  scale_rows(*from++);
  const double* orders = from;
  from += 1 + complex_.size();
  std::copy_n(from, col_scale_.size(), col_scale_.begin());
  from += col_scale_.size();
  if (has_real()) {
    if (!real_->restore(static_cast<long>(*orders), from)) return false;
    from += real_->saved_size();
  }
  for (auto& c : complex_) {
    if (!c.restore(static_cast<long>(*++orders), from)) return false;
    from += c.saved_size();
  }
  return true;
}

void StageMatrix::scale_rows(double h) {
  h_ = h;
  for (std::size_t i = 0; i < row_scale_.size(); ++i) row_scale_[i] = differential_[i] ? h : 1;
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
  scale_rows(h);
  filter_ready_ = has_real();
  const double size = std::abs(scheme_.shift.front());
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

template <int stages>
void StageMatrix::solve_stages(double* x, bool transposed) {
  // (R A C)^-1 with R, C the scales: A^-1 = C (.)^-1 R, and transposed R (.)^-T C.
  const Eigen::Map<const Eigen::ArrayXd> before((transposed ? col_scale_ : row_scale_).data(), n_),
      after((transposed ? row_scale_ : col_scale_).data(), n_);
  Eigen::Map<Eigen::Array<double, Eigen::Dynamic, stages>> X(x, n_, stages),
      parts(parts_.data(), n_, stages);  // a real one, then real and imaginary ones in turn
  Eigen::Matrix<double, stages, stages> in, out;
  Eigen::Index part = 0;
  for (std::size_t k = 0; k < scheme_.shift.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    const Eigen::Matrix<std::complex<double>, stages, 1> of_row = scheme_.t_inverse.row(column).transpose(),
                                                         of_column = scheme_.t.col(column);
    const auto &to = transposed ? of_column : of_row, &from = transposed ? of_row : of_column;
    in.col(part) = to.real();
    if (scheme_.shift[k].imag() == 0) {
      out.row(part++) = from.real().transpose();
      continue;
    }
    in.col(part + 1) = to.imag();
    // The conjugate gives the conjugate.
    out.row(part) = 2 * from.real().transpose();
    out.row(part + 1) = -2 * from.imag().transpose();
    part += 2;
  }
  for (int p = 0; p < stages; ++p) parts.col(p) = before * (X.matrix().lazyProduct(in.col(p))).array();
  if (has_real()) {
    if (transposed)
      real_->solve_transposed(parts.col(0).data());
    else
      real_->solve(parts.col(0).data());
  }
  const int first = has_real() ? 1 : 0;
  for (std::size_t pair = 0; pair < complex_.size(); ++pair) {
    double *re = parts.col(first + 2 * static_cast<int>(pair)).data(), *im = re + n_;
    for (std::size_t e = 0; e < complex_right_.size(); ++e) complex_right_[e] = {re[e], im[e]};
    if (transposed)
      complex_[pair].solve_transposed(complex_right_.data());
    else
      complex_[pair].solve(complex_right_.data());
    for (std::size_t e = 0; e < complex_right_.size(); ++e) {
      re[e] = complex_right_[e].real();
      im[e] = complex_right_[e].imag();
    }
  }
  for (int i = 0; i < stages; ++i) X.col(i) = after * (parts.matrix().lazyProduct(out.col(i))).array();
}

void StageMatrix::solve_apart(double* x, bool transposed) {
  switch (scheme_.stages) {
    case 2:
      return solve_stages<2>(x, transposed);
    case 3:
      return solve_stages<3>(x, transposed);
    case 5:
      return solve_stages<5>(x, transposed);
    default:
      throw Error("There is no stage matrix of so many stages.");
  }
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
