#include "costate/integrator/linear_stages.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace costate {

namespace {
// What direct solutions leave of the largest unknown, in units in which all columns of the matrix have size 1.
constexpr double kRounding = 1e-14;
// Corrections that fall more slowly, or are more than so many, give way to the factors of all stages together, and then
// for so many steps.
constexpr double kSlow = 0.5;
constexpr int kMostCorrections = 20, kTogetherFor = 10;
// Factors of an earlier step: of the same length but for rounding, and as long as a correction leaves so little.
constexpr double kSameStep = 1e-6, kQuick = 0.03, kSlowKept = 0.15;
}  // namespace

LinearStages::LinearStages(const HandEquations& equations, const RadauScheme& scheme)
    : eq_(equations), scheme_(scheme), s_(scheme.stages), n_(equations.size()) {
  real_ = std::make_unique<KluSolver>(eq_.pattern());
  values_.resize(eq_.pattern().row.size());
  for (std::size_t k = 1; k < scheme.shift.size(); ++k)
    complex_.push_back({scheme.shift[k], 0, ComplexKluSolver(eq_.pattern()),
                        std::vector<std::complex<double>>(values_.size()),
                        std::vector<std::complex<double>>(static_cast<std::size_t>(n_))});
  A_.resize(static_cast<std::size_t>(s_));
  D_.resize(static_cast<std::size_t>(s_));
  mean_A_ = mean_D_ = values_;
  real_right_.resize(n_);
  row_scale_.resize(n_);
  column_scale_.resize(n_);
  flow_.resize(n_, s_);
  in_D_.assign(values_.size(), 0);
  for (int j = 0; j < n_; ++j)
    for (auto e = eq_.pattern().column_start[j]; e < eq_.pattern().column_start[j + 1]; ++e) column_.push_back(j);
}

void LinearStages::take(int i) {
  const auto at = static_cast<std::size_t>(i);
  A_[at].assign(eq_.A().begin(), eq_.A().end());
  D_[at].assign(eq_.D().begin(), eq_.D().end());
  for (std::size_t e = 0; e < D_[at].size(); ++e)
    if (D_[at][e] != 0 && in_D_[e] == 0) {
      in_D_[e] = 1;
      D_at_.push_back(e);
    }
}

int LinearStages::prepare(double h) {
  h_ = h;
  if (together_for_ > 0) --together_for_;
  fresh_ = false;
  rate_ = 1;
  if (together_for_ == 0 && (keeps_factors() || factor_apart())) {
    way_ = Way::apart;
    return -1;
  }
  return factor_together();
}

bool LinearStages::keeps_factors() const {
  return factored_h_ != 0 && std::abs(h_ - factored_h_) <= kSameStep * std::abs(factored_h_) && slowest_rate_ <= kQuick;
}

// Multipliers come with factors of h, two of them in index 3: with rows multiplied by their powers of h and brought to
// size 1 column by column, a small step is not taken for a singular matrix.
bool LinearStages::factor_apart() {
  const SparsePattern& p = eq_.pattern();
  for (std::size_t e = 0; e < values_.size(); ++e) {
    mean_A_[e] = mean_D_[e] = 0;
    for (std::size_t i = 0; i < A_.size(); ++i) {
      mean_A_[e] += A_[i][e] / s_;
      mean_D_[e] += D_[i][e] / s_;
    }
  }
  for (int i = 0; i < n_; ++i) row_scale_[i] = std::pow(std::abs(h_), eq_.step_power(i));
  for (Complex& c : complex_) c.step = h_ / c.shift;
  const double real_step = h_ / scheme_.shift[0].real();
  for (int j = 0; j < n_; ++j) {
    const auto first = p.column_start[static_cast<std::size_t>(j)],
               last = p.column_start[static_cast<std::size_t>(j) + 1];
    double largest = 0;
    for (auto e = first; e < last; ++e) {
      const auto at = static_cast<std::size_t>(e);
      const int row = static_cast<int>(p.row[at]);
      const double scale = row_scale_[row];
      const bool differential = eq_.differential(row);
      values_[at] = scale * (differential ? mean_D_[at] - real_step * mean_A_[at] : mean_A_[at]);
      for (Complex& c : complex_)
        c.values[at] = scale * (differential ? mean_D_[at] - c.step * mean_A_[at] : mean_A_[at]);
      largest = std::max(largest, std::abs(values_[at]));
    }
    const double scale = largest > 0 ? 1 / largest : 1;
    column_scale_[j] = scale;
    for (auto e = first; e < last; ++e) {
      values_[static_cast<std::size_t>(e)] *= scale;
      for (Complex& c : complex_) c.values[static_cast<std::size_t>(e)] *= scale;
    }
  }
  factorizations_ += 1 + static_cast<long>(complex_.size());
  slowest_rate_ = 0;
  fresh_ = real_->factor(values_.data()) < 0 && std::all_of(complex_.begin(), complex_.end(), [](Complex& c) {
             return c.solver.factor(c.values.data()) < 0;
           });
  factored_h_ = fresh_ ? h_ : 0;
  return fresh_;
}

// Column block i of the matrix of all stages, from A and D at stage i: rows of stage j get -h a_ji A_i, stage i also
// D_i (or A_i on algebraic rows).
int LinearStages::factor_together() {
  way_ = Way::together;
  const SparsePattern& p = eq_.pattern();
  if (!matrix_) {
    matrix_ = std::make_unique<BlockMatrix>(s_ * n_);
    std::vector<std::pair<int, int>> entries;
    for (int j = 0; j < n_; ++j)
      for (auto e = p.column_start[j]; e < p.column_start[j + 1]; ++e)
        if (eq_.differential(static_cast<int>(p.row[e]))) entries.emplace_back(static_cast<int>(p.row[e]), j);
    differential_rows_ = SparsePattern::from_entries(n_, n_, entries);
    for (int j = 0; j < n_; ++j)
      for (auto e = differential_rows_.column_start[j]; e < differential_rows_.column_start[j + 1]; ++e)
        differential_of_.push_back(p.find(static_cast<int>(differential_rows_.row[e]), j));
    block_.resize(s_, s_);
    for (int i = 0; i < s_; ++i)
      for (int j = 0; j < s_; ++j) block_(i, j) = matrix_->place(i == j ? p : differential_rows_, i * n_, j * n_);
    matrix_->finalize();
    together_ = std::make_unique<KluSolver>(matrix_->pattern());
    part_.resize(differential_of_.size());
    scaled_.resize(matrix_->values().size());
    all_rows_scale_.resize(s_ * n_);
    all_columns_scale_.resize(s_ * n_);
  }
  matrix_->set_zero();
  const Eigen::MatrixXd& a = scheme_.a;
  for (int i = 0; i < s_; ++i) {
    const auto &A = A_[static_cast<std::size_t>(i)], &D = D_[static_cast<std::size_t>(i)];
    for (std::size_t e = 0; e < p.row.size(); ++e)
      values_[e] = eq_.differential(static_cast<int>(p.row[e])) ? D[e] - h_ * a(i, i) * A[e] : A[e];
    matrix_->add(block_(i, i), values_.data());
    for (int j = 0; j < s_; ++j) {
      if (j == i) continue;
      for (std::size_t e = 0; e < part_.size(); ++e)
        part_[e] = -h_ * a(j, i) * A[static_cast<std::size_t>(differential_of_[e])];
      matrix_->add(block_(j, i), part_.data());
    }
  }
  const SparsePattern& all = matrix_->pattern();
  const auto values = matrix_->values();
  for (int i = 0; i < all.rows; ++i) all_rows_scale_[i] = std::pow(std::abs(h_), eq_.step_power(i % n_));
  for (int j = 0; j < all.cols; ++j) {
    double largest = 0;
    for (auto e = all.column_start[j]; e < all.column_start[j + 1]; ++e)
      largest = std::max(largest, all_rows_scale_[all.row[e]] * std::abs(values[static_cast<std::size_t>(e)]));
    const double scale = largest > 0 ? 1 / largest : 1;
    all_columns_scale_[j] = scale;
    for (auto e = all.column_start[j]; e < all.column_start[j + 1]; ++e)
      scaled_[static_cast<std::size_t>(e)] = all_rows_scale_[all.row[e]] * scale * values[static_cast<std::size_t>(e)];
  }
  ++factorizations_;
  const int bad = together_->factor(scaled_.data());
  return bad < 0 ? -1 : bad % n_;
}

void LinearStages::solve_together(Eigen::MatrixXd& right) {
  for (Eigen::Index j = 0; j < right.cols(); ++j) right.col(j).array() *= all_rows_scale_;
  together_->solve(right.data(), static_cast<int>(right.cols()));
  for (Eigen::Index j = 0; j < right.cols(); ++j) right.col(j).array() *= all_columns_scale_;
}

void LinearStages::solve_apart(const Eigen::MatrixXd& right, Eigen::MatrixXd& out) {
  out.resize(right.rows(), right.cols());
  const auto &to = scheme_.t_inverse, &from = scheme_.t;
  for (Eigen::Index j = 0; j < right.cols(); ++j) {
    const double* given = right.col(j).data();
    for (int row = 0; row < n_; ++row) {
      double x = 0;
      for (int i = 0; i < s_; ++i) x += to(0, i).real() * given[i * n_ + row];
      real_right_[row] = row_scale_[row] * x;
    }
    real_->solve(real_right_.data());
    for (std::size_t k = 0; k < complex_.size(); ++k) {
      Complex& c = complex_[k];
      const auto pair = static_cast<Eigen::Index>(k) + 1;
      for (int row = 0; row < n_; ++row) {
        std::complex<double> x = 0;
        for (int i = 0; i < s_; ++i) x += to(pair, i) * given[i * n_ + row];
        c.right[static_cast<std::size_t>(row)] = row_scale_[row] * x;
      }
      c.solver.solve(c.right.data());
    }
    // The conjugate gives the conjugate.
    for (int i = 0; i < s_; ++i)
      for (int row = 0; row < n_; ++row) {
        double x = from(i, 0).real() * real_right_[row];
        for (std::size_t k = 0; k < complex_.size(); ++k) {
          const std::complex<double> weight = from(i, static_cast<Eigen::Index>(k) + 1),
                                     y = complex_[k].right[static_cast<std::size_t>(row)];
          x += 2 * (weight.real() * y.real() - weight.imag() * y.imag());
        }
        out(i * n_ + row, j) = column_scale_[row] * x;
      }
  }
}

void LinearStages::calc_residual(const Eigen::MatrixXd& right, const Eigen::MatrixXd& X, Eigen::MatrixXd& left) {
  left.resize(right.rows(), right.cols());
  const SparsePattern& p = eq_.pattern();
  for (Eigen::Index j = 0; j < right.cols(); ++j) {
    flow_.setZero();
    for (int i = 0; i < s_; ++i) {
      const double* x = X.col(j).data() + static_cast<std::ptrdiff_t>(i) * n_;
      const auto at = static_cast<std::size_t>(i);
      add_product(p, A_[at].data(), 1, x, flow_.col(i).data());
      left.col(j).segment(i * n_, n_) = right.col(j).segment(i * n_, n_);
      double* l = left.col(j).data() + static_cast<std::ptrdiff_t>(i) * n_;
      for (const std::size_t e : D_at_) l[p.row[e]] -= D_[at][e] * x[column_[e]];
    }
    for (int i = 0; i < s_; ++i)
      for (int row = 0; row < n_; ++row) {
        double& r = left(i * n_ + row, j);
        if (!eq_.differential(row)) {
          r = right(i * n_ + row, j) - flow_(row, i);
          continue;
        }
        for (int l = 0; l < s_; ++l) r += h_ * scheme_.a(i, l) * flow_(row, l);
      }
  }
}

double LinearStages::measure(const Eigen::MatrixXd& x, const Eigen::MatrixXd& X, double tolerance) const {
  double worst = 0;
  const auto groups = static_cast<Eigen::Index>(eq_.groups());
  Eigen::ArrayXd size(groups), change(groups);
  for (Eigen::Index j = 0; j < X.cols(); ++j) {
    size.setZero();
    change.setZero();
    double all = 0, moved = 0;  // in units of columns
    for (Eigen::Index k = 0; k < X.rows(); ++k) {
      const int row = static_cast<int>(k % n_), group = eq_.group(row);
      const double value = std::abs(X(k, j)), step = std::abs(x(k, j));
      if (!std::isfinite(value) || !std::isfinite(step)) return std::numeric_limits<double>::infinity();
      size[group] = std::max(size[group], value);
      change[group] = std::max(change[group], step);
      all = std::max(all, value / column_scale_[row]);
      moved = std::max(moved, step / column_scale_[row]);
    }
    double of_groups = 0;
    for (Eigen::Index g = 0; g < groups; ++g)
      if (change[g] > 0) of_groups = std::max(of_groups, change[g] / (tolerance * size[g]));
    worst = std::max(worst, moved > 0 ? std::min(of_groups, moved / (kRounding * all)) : 0);
  }
  return worst;
}

int LinearStages::solve(Eigen::MatrixXd& right, double tolerance) {
  if (way_ == Way::together) {
    solve_together(right);
    return -1;
  }
  given_ = right;
  solve_apart(given_, right);
  if (rate_ <= tolerance || correct(right, tolerance)) return -1;
  if (!fresh_ && factor_apart()) {
    solve_apart(given_, right);
    if (correct(right, tolerance)) return -1;
  }
  together_for_ = kTogetherFor;
  factored_h_ = 0;
  if (const int bad = factor_together(); bad >= 0) return bad;
  right = given_;
  solve_together(right);
  return -1;
}

bool LinearStages::correct(Eigen::MatrixXd& X, double tolerance) {
  double before = 0;
  rate_ = 1;
  for (int k = 0; k < kMostCorrections; ++k) {
    calc_residual(given_, X, left_);
    solve_apart(left_, change_);
    X += change_;
    ++corrections_;
    const double size = measure(change_, X, tolerance);
    if (size == 0) return true;
    // What is left behind this correction.
    const double rate = k == 0 ? kSlow : size / before;
    if (k > 0 && before > 1) {
      rate_ = k == 1 ? rate : std::max(rate_, rate);
      slowest_rate_ = std::max(slowest_rate_, rate);
    }
    if (!(rate <= (fresh_ || k == 0 ? kSlow : kSlowKept)) && !(size <= 1)) return false;
    if (size * rate <= 1) return true;
    before = size;
  }
  return false;
}

}  // namespace costate
