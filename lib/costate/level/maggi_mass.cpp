#include "costate/level/maggi_mass.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/level/maggi_ratio.h"
#include "costate/linear/dense_factor.h"

namespace costate {

namespace {
constexpr int kColumnsAtOnce = 64;
/// Of a row's largest entry: charts are chosen anew where they are ten times worse than the best, far from singular.
constexpr double kTurned = 0.01;
}  // namespace

MaggiMass::MaggiMass(Assembly& assembly, MaggiPositions& positions, int most_full)
    : assembly_(assembly),
      positions_(positions),
      n_(assembly.n()),
      m_(assembly.m()),
      f_(positions.freedoms()),
      rows_(std::max(m_ + f_, n_)),
      sparse_(f_ > most_full && !positions.redundant() && !assembly.has_switched_rows()),
      kkt_(std::max(1, n_ + m_)) {
  work_.assign(static_cast<std::size_t>(sparse_ ? n_ + m_ : rows_), 0);
  if (!sparse_) return;
  mass_block_ = kkt_.place(assembly.square(), 0, 0);
  transposed_block_ = kkt_.place(assembly.jacobian(), 0, n_, true);
  jacobian_block_ = kkt_.place(assembly.jacobian(), n_, 0);
  kkt_.finalize();
  solver_ = std::make_unique<KluSolver>(kkt_.pattern());
}

void MaggiMass::solve_columns(MaggiChart& chart, int first, int count, double* R) {
  std::fill_n(R, static_cast<std::ptrdiff_t>(count) * rows_, 0.0);
  for (int j = 0; j < count; ++j) R[static_cast<std::ptrdiff_t>(j) * rows_ + m_ + first + j] = 1;
  chart.solve(R, count);
}

void MaggiMass::calc_null_space(MaggiChart& chart, std::vector<double>& R) {
  R.resize(static_cast<std::size_t>(rows_) * f_);
  solve_columns(chart, 0, f_, R.data());
  if (rows_ == n_) return;
  for (int j = 1; j < f_; ++j)
    std::copy_n(R.data() + static_cast<std::ptrdiff_t>(j) * rows_, n_, R.data() + static_cast<std::ptrdiff_t>(j) * n_);
}

double* MaggiMass::null_space() {
  if (!has_null_space_) calc_null_space(positions_.chart(), R_);
  has_null_space_ = true;
  return R_.data();
}

const double* MaggiMass::reaction_null_space() {
  if (!positions_.slides()) return null_space();
  if (!has_reactions_) calc_null_space(positions_.reaction_chart(), Rr_);
  has_reactions_ = true;
  return Rr_.data();
}

bool MaggiMass::has_turned() const {
  if (ratio_at_.empty()) return true;
  for (std::size_t e = 0; e < ratio_at_.size(); ++e)
    if (std::abs(assembly_.phi_q[e] - ratio_at_[e]) >
        kTurned * row_sizes_[static_cast<std::size_t>(assembly_.jacobian().row[e])])
      return true;
  return false;
}

double MaggiMass::chart_ratio() {
  if (!sparse_) {
    const double ratio = positions_.ratio(null_space(), 0, f_);
    return positions_.slides() ? std::max(ratio, positions_.reaction_ratio(reaction_null_space())) : ratio;
  }
  if (!has_turned()) return ratio_;
  ratio_at_ = assembly_.phi_q;
  row_sizes_.assign(static_cast<std::size_t>(m_), 0);
  for (std::size_t e = 0; e < ratio_at_.size(); ++e) {
    double& size = row_sizes_[static_cast<std::size_t>(assembly_.jacobian().row[e])];
    size = std::max(size, std::abs(ratio_at_[e]));
  }
  if (f_ > kMostExactFreedoms) {
    std::vector<double> weight;
    for (const double size : positions_.sizes()) weight.push_back(1 / size);
    return ratio_ = find_largest_ratio(positions_.chart(), weight).ratio;
  }
  std::vector<double> columns(static_cast<std::size_t>(rows_) * kColumnsAtOnce);
  ratio_ = 0;
  for (int j = 0; j < f_; j += kColumnsAtOnce) {
    const int count = std::min(kColumnsAtOnce, f_ - j);
    solve_columns(positions_.chart(), j, count, columns.data());
    ratio_ = std::max(ratio_, positions_.ratio(columns.data(), j, count));
  }
  return ratio_;
}

void MaggiMass::calc_matrix(double t) {
  if (has_matrix_) return;
  My_.resize(static_cast<std::size_t>(f_) * f_);
  const double *R = null_space(), *Rr = reaction_null_space();
  const bool slides = positions_.slides();
  for (int j = 0; j < f_; ++j) {
    double* mr = work_.data();
    std::fill(work_.begin(), work_.end(), 0.0);
    add_product(assembly_.square(), assembly_.M.data(), 1, R + static_cast<std::ptrdiff_t>(j) * n_, mr);
    for (int i = 0; i <= (slides ? f_ - 1 : j); ++i) {
      const double* r = Rr + static_cast<std::ptrdiff_t>(i) * n_;
      double sum = 0;
      for (int k = 0; k < n_; ++k) sum += r[k] * mr[k];
      My_[static_cast<std::size_t>(j) * f_ + i] = sum;
      if (!slides) My_[static_cast<std::size_t>(i) * f_ + j] = sum;
    }
  }
  for (std::size_t j = positions_.chart().independent().size(); j < static_cast<std::size_t>(f_); ++j)
    My_[j * static_cast<std::size_t>(f_) + j] = 1;  // of places, which stay
  factor_ = My_;
  pivots_.resize(static_cast<std::size_t>(f_));
  const int bad = slides ? factor_lu(factor_.data(), f_, pivots_.data()) : factor_cholesky(factor_.data(), f_);
  if (bad >= 0) singular(t, bad);
  has_matrix_ = true;
}

const double* MaggiMass::matrix(double t) {
  calc_matrix(t);
  return My_.data();
}

void MaggiMass::singular(double t, int column) const {
  if (positions_.slides())
    throw SolverError(
        fmt::format("At t = {:.9g} s friction leaves the accelerations undetermined: the normal force of what slides "
                    "grows beyond all bounds (Painleve). Take less friction, or kind = \"compliant\".",
                    t));
  const auto& name = assembly_.mechanism().coordinates()[positions_.chart().independent()[column]].name;
  throw SolverError(
      fmt::format("The accelerations at t = {:.9g} s are not determined: the motion that '{}' stands for "
                  "moves no mass. Give the bodies that it moves mass, or constrain it.",
                  t, name));
}

void MaggiMass::calc_factor(double t) {
  if (has_factor_) return;
  kkt_.set_zero();
  kkt_.add(mass_block_, assembly_.M.data());
  kkt_.add(transposed_block_, assembly_.phi_q.data());
  kkt_.add(jacobian_block_, assembly_.phi_q.data());
  if (solver_->factor(kkt_.values().data()) >= 0) {
    matrix(t);  // names the motion
    throw SolverError(fmt::format("The accelerations at t = {:.9g} s are not determined.", t));
  }
  has_factor_ = true;
}

void MaggiMass::project(const double* x, double* out) {
  if (sparse_) {
    std::copy(x, x + n_, work_.begin());
    positions_.chart().solve_transposed(work_.data());
    std::copy_n(work_.begin() + m_, f_, out);
    return;
  }
  project_by(reaction_null_space(), x, out);
}

void MaggiMass::project_rates(const double* x, double* out) {
  if (sparse_) return project(x, out);
  project_by(null_space(), x, out);
}

void MaggiMass::project_by(const double* R, const double* x, double* out) const {
  for (int j = 0; j < f_; ++j, R += n_) {
    double sum = 0;
    for (int i = 0; i < n_; ++i) sum += R[i] * x[i];
    out[j] = sum;
  }
}

void MaggiMass::expand(const double* y, double* out) {
  if (sparse_) {
    std::fill_n(work_.begin(), m_, 0.0);
    std::copy_n(y, f_, work_.begin() + m_);
    positions_.chart().solve(work_.data());
    std::copy_n(work_.begin(), n_, out);
    return;
  }
  expand_by(null_space(), y, out);
}

void MaggiMass::expand_forces(const double* y, double* out) {
  if (sparse_) return expand(y, out);
  expand_by(reaction_null_space(), y, out);
}

void MaggiMass::expand_by(const double* R, const double* y, double* out) const {
  std::fill(out, out + n_, 0.0);
  for (int j = 0; j < f_; ++j, R += n_)
    for (int i = 0; i < n_; ++i) out[i] += R[i] * y[j];
}

void MaggiMass::solve_transposed(double t, double* b) {
  if (sparse_ || !positions_.slides()) return solve(t, b);
  calc_matrix(t);
  solve_lu_transposed(factor_.data(), f_, pivots_.data(), b);
}

void MaggiMass::solve(double t, double* b) {
  if (!sparse_) {
    calc_matrix(t);
    if (positions_.slides()) return solve_lu(factor_.data(), f_, pivots_.data(), b);
    solve_cholesky(factor_.data(), f_, b);
    return;
  }
  calc_factor(t);
  const std::vector<int>& independent = positions_.chart().independent();
  std::fill(work_.begin(), work_.end(), 0.0);
  for (int j = 0; j < f_; ++j) work_[static_cast<std::size_t>(independent[j])] = b[j];
  solver_->solve(work_.data());
  for (int j = 0; j < f_; ++j) b[j] = work_[static_cast<std::size_t>(independent[j])];
}

}  // namespace costate
