#include "costate/integrator/radau_linear.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"

namespace costate {

namespace {
const double r6 = std::sqrt(6.0);
const double c[3] = {(4 - r6) / 10, (4 + r6) / 10, 1};
const double a[3][3] = {{(88 - 7 * r6) / 360, (296 - 169 * r6) / 1800, (-2 + 3 * r6) / 225},
                        {(296 + 169 * r6) / 1800, (88 + 7 * r6) / 360, (-2 - 3 * r6) / 225},
                        {(16 - r6) / 36, (16 + r6) / 36, 1.0 / 9}};
}  // namespace

RadauLinear::RadauLinear(HandEquations& equations)
    : eq_(equations), N_(equations.size()), k_(equations.columns()), stages_(3 * equations.size()) {
  const SparsePattern& p = eq_.pattern();
  std::vector<std::pair<int, int>> entries;
  for (int j = 0; j < N_; ++j)
    for (auto e = p.column_start[j]; e < p.column_start[j + 1]; ++e)
      if (eq_.differential(static_cast<int>(p.row[e]))) entries.emplace_back(static_cast<int>(p.row[e]), j);
  differential_rows_ = SparsePattern::from_entries(N_, N_, entries);
  for (int j = 0; j < N_; ++j)
    for (auto e = differential_rows_.column_start[j]; e < differential_rows_.column_start[j + 1]; ++e)
      differential_of_.push_back(p.find(static_cast<int>(differential_rows_.row[e]), j));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) block_[i][j] = stages_.place(i == j ? p : differential_rows_, i * N_, j * N_);
  stages_.finalize();
  solver_ = std::make_unique<KluSolver>(stages_.pattern());
  values_.resize(p.row.size());
  part_.resize(differential_of_.size());
}

// Column block i of the stage matrix, from A and D at stage i: rows of stage j get -h a_ji A_i, stage i also D_i (or
// A_i on algebraic rows).
void RadauLinear::fill_stage(int i, double h) {
  const SparsePattern& p = eq_.pattern();
  const auto A = eq_.A(), D = eq_.D();
  for (std::size_t e = 0; e < p.row.size(); ++e) {
    const bool differential = eq_.differential(static_cast<int>(p.row[e]));
    values_[e] = differential ? D[e] - h * a[i][i] * A[e] : A[e];
  }
  stages_.add(block_[i][i], values_.data());
  for (int j = 0; j < 3; ++j) {
    if (j == i) continue;
    for (std::size_t e = 0; e < part_.size(); ++e) part_[e] = -h * a[j][i] * A[static_cast<std::size_t>(differential_of_[e])];
    stages_.add(block_[j][i], part_.data());
  }
}

// Multipliers come with factors of h, two of them in index 3: brought to size 1 column by column (rows are scaled by the
// solver itself), a small step is not taken for a singular matrix.
void RadauLinear::equilibrate() {
  const SparsePattern& p = stages_.pattern();
  const auto values = stages_.values();
  scaled_.resize(values.size());
  column_scale_.resize(p.cols);
  for (int j = 0; j < p.cols; ++j) {
    double largest = 0;
    for (auto e = p.column_start[j]; e < p.column_start[j + 1]; ++e)
      largest = std::max(largest, std::abs(values[static_cast<std::size_t>(e)]));
    const double scale = largest > 0 ? 1 / largest : 1;
    column_scale_[j] = scale;
    for (auto e = p.column_start[j]; e < p.column_start[j + 1]; ++e)
      scaled_[static_cast<std::size_t>(e)] = scale * values[static_cast<std::size_t>(e)];
  }
}

RadauResult RadauLinear::integrate(const Trajectory& trajectory, const std::vector<double>& grid,
                                   const std::function<void(double, const Eigen::MatrixXd&)>& observe) {
  const bool forward = eq_.direction() == HandEquations::Direction::forward;
  const std::size_t count = grid.size();
  const auto time = [&](std::size_t i) { return forward ? grid[i] : grid[count - 1 - i]; };
  const int np = eq_.parameter_count();
  RadauResult r;
  r.gradient = Eigen::VectorXd::Zero(np);
  std::vector<double> y(static_cast<std::size_t>(trajectory.width()));
  Eigen::MatrixXd X(N_, k_), W(N_, k_), right(3 * N_, k_);
  Eigen::VectorXd integrand(np);
  const auto momentum = [&] {
    W = eq_.d();
    for (int j = 0; j < k_; ++j) add_product(eq_.pattern(), eq_.D().data(), 1, X.col(j).data(), W.col(j).data());
  };
  trajectory.evaluate(time(0), y.data());
  eq_.evaluate(time(0), y.data());
  eq_.begin(X, r.gradient);
  eq_.evaluate(time(0), y.data());
  momentum();
  if (observe) observe(time(0), X);
  Eigen::MatrixXd b[3], d[3];
  for (std::size_t step = 0; step + 1 < count; ++step) {
    const double t0 = time(step), h = time(step + 1) - t0;
    trajectory.evaluate(t0, y.data());
    if (eq_.before_step(t0, time(step + 1), y.data(), X, r.gradient)) {
      eq_.evaluate(t0, y.data());
      momentum();
    }
    stages_.set_zero();
    for (int i = 0; i < 3; ++i) {
      const double t = i == 2 ? time(step + 1) : t0 + c[i] * h;
      trajectory.evaluate(t, y.data());
      eq_.evaluate(t, y.data());
      ++r.evaluations;
      b[i] = eq_.b();
      d[i] = eq_.d();
      fill_stage(i, h);
    }
    for (int i = 0; i < 3; ++i)
      for (int row = 0; row < N_; ++row)
        for (int j = 0; j < k_; ++j) {
          double x = -b[i](row, j);
          if (eq_.differential(row)) {
            x = W(row, j) - d[i](row, j);
            for (int l = 0; l < 3; ++l) x += h * a[i][l] * b[l](row, j);
          }
          right(i * N_ + row, j) = x;
        }
    equilibrate();
    const int bad = solver_->factor(scaled_.data());
    if (bad >= 0)
      throw SolverError(fmt::format("The hand-derived equations are singular at t = {:.9g} s, unknown '{}'.", t0,
                                    eq_.names()[static_cast<std::size_t>(bad % N_)]));
    ++r.factorizations;
    solver_->solve(right.data(), k_);
    for (int j = 0; j < k_; ++j) right.col(j).array() *= column_scale_;
    // Quadrature with the scheme's weights (its last row), the integrand at each stage.
    for (int i = 0; i < 3; ++i) {
      const double t = i == 2 ? time(step + 1) : t0 + c[i] * h;
      trajectory.evaluate(t, y.data());
      eq_.evaluate(t, y.data());
      X = right.middleRows(i * N_, N_);
      eq_.integrand(X, integrand);
      r.gradient += (forward ? h : -h) * a[2][i] * integrand;
    }
    momentum();
    ++r.steps;
    if (observe) observe(time(step + 1), X);
  }
  eq_.finish(X, r.gradient);
  return r;
}

}  // namespace costate
