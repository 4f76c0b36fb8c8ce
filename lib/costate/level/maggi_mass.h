// R and My = R^T M R of Maggi's equations (lib/README.md (5)) at the point of a MaggiLevel: products with R and R^T,
// and solutions with My. Of few freedoms, or with redundant rows, by full matrices and Cholesky's factors, whose work
// grows with n f^2. Of many by sparse factors alone: R y and R^T x are solutions with the chart's, and
//   My w = g   as   [M, Phi_q^T; Phi_q, 0] [a; p] = [B^T g; 0],   w = B a,   since R^T B^T = 1.
#pragma once

#include <memory>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/level/maggi_positions.h"

namespace costate {

class MaggiMass {
 public:
  /// More freedoms than these are not put into full matrices.
  static constexpr int kMostFull = kMostFullFreedoms;

  MaggiMass(Assembly& assembly, MaggiPositions& positions, int most_full = kMostFull);

  bool sparse() const { return sparse_; }
  /// Nothing is known at the point yet.
  void clear() { has_null_space_ = has_reactions_ = has_matrix_ = has_factor_ = false; }
  /// Nor of the chart.
  void forget_chart() { ratio_at_.clear(); }

  /// out = R_r^T x (f), out = R y (n). R_r is R but where contacts slide (maggi_rows.h), My = R_r^T M R.
  void project(const double* x, double* out);
  void expand(const double* y, double* out);
  /// b := My^-1 b with M at the first call since clear(). Throws SolverError for motions, at time t, that move no mass.
  void solve(double t, double* b);
  // Transposed: out = R^T x, out = R_r y, b := My^-T b.
  void project_rates(const double* x, double* out);
  void expand_forces(const double* y, double* out);
  void solve_transposed(double t, double* b);
  /// How far the chart is from the best one: 1 is best, infinite is singular. Of many freedoms that of an earlier point
  /// while no row of Phi_q has turned by more than a hundredth since.
  double chart_ratio();

  /// R (n x f, columns one after the other), to be overwritten if wanted; and My (f x f).
  double* null_space();
  /// R_r likewise.
  const double* reaction_null_space();
  const double* matrix(double t);

 private:
  /// Columns [first, first + count) of R of a chart, with rows() entries each.
  void solve_columns(MaggiChart& chart, int first, int count, double* R);
  /// All columns of R of a chart, n entries each.
  void calc_null_space(MaggiChart& chart, std::vector<double>& R);
  void project_by(const double* R, const double* x, double* out) const;
  void expand_by(const double* R, const double* y, double* out) const;
  void calc_matrix(double t);
  void calc_factor(double t);
  bool has_turned() const;
  [[noreturn]] void singular(double t, int column) const;

  Assembly& assembly_;
  MaggiPositions& positions_;
  int n_, m_, f_, rows_;
  bool sparse_, has_null_space_ = false, has_reactions_ = false, has_matrix_ = false, has_factor_ = false;
  std::vector<double> R_, Rr_, My_, factor_, work_;
  std::vector<int> pivots_;  // of My where contacts slide
  BlockMatrix kkt_;
  int mass_block_ = -1, jacobian_block_ = -1, transposed_block_ = -1;
  std::unique_ptr<KluSolver> solver_;
  double ratio_ = 0;
  std::vector<double> ratio_at_, row_sizes_;  // Phi_q at that ratio's point, and the largest entries of its rows
};

}  // namespace costate
