// The stages of a Radau IIA step of the linear descriptor systems of adjoint/hand_equations.h:
//   D_i X_i - h sum_j a_ij A_j X_j = r_i  on differential rows,   A_i X_i = r_i  on algebraic rows,   i = 1, ..., s.
// With the mean of the stages' matrices in the place of each, and a = T diag(1/shift) T^-1, they fall apart into
// D - (h/shift) A: a real matrix and (s - 1)/2 complex ones of the size of the system, of an odd s. Their solutions are
// corrected by what they leave of the system itself until nothing that counts is left; as long as that takes few
// corrections the factors serve the next steps of the same length, too. Where fresh ones take long, all stages together
// are factored. Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.8.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <memory>
#include <vector>

#include "costate/adjoint/hand_equations.h"
#include "costate/discrete/radau_scheme.h"
#include "costate/linear/complex_klu_solver.h"
#include "costate/linear/klu_solver.h"

namespace costate {

class LinearStages {
 public:
  /// `equations` and `scheme` outlive this.
  LinearStages(const HandEquations& equations, const RadauScheme& scheme);

  const RadauScheme& scheme() const { return scheme_; }
  /// Takes A and D of the evaluated point as those of stage i; times h of a step that prepare() is told.
  void take(int i);
  const std::vector<double>& A(int i) const { return A_[static_cast<std::size_t>(i)]; }
  /// Returns -1, or an unknown found (numerically) dependent.
  [[nodiscard]] int prepare(double h);
  /// In place, the stages of each column below each other (s N rows): a solution that is right to `tolerance` of the
  /// size of each group of unknowns in its column, or to rounding. Without a look at what it leaves where corrections
  /// of the same stages have left less than that. The same return value.
  [[nodiscard]] int solve(Eigen::MatrixXd& right, double tolerance);
  /// Of a matrix of the system's size, or of all stages together.
  long factorizations() const { return factorizations_; }
  /// Solutions with the mean matrices that corrected an earlier one.
  long corrections() const { return corrections_; }

 private:
  enum class Way { apart, together };
  /// Whether the factors of an earlier step are good for this one.
  bool keeps_factors() const;
  [[nodiscard]] bool factor_apart();
  /// Corrects X until `tolerance` is met; false where that would take long.
  [[nodiscard]] bool correct(Eigen::MatrixXd& X, double tolerance);
  [[nodiscard]] int factor_together();
  /// out := the solution with the mean matrices.
  void solve_apart(const Eigen::MatrixXd& right, Eigen::MatrixXd& out);
  void solve_together(Eigen::MatrixXd& right);
  /// left := right - (the system) X.
  void calc_residual(const Eigen::MatrixXd& right, const Eigen::MatrixXd& X, Eigen::MatrixXd& left);
  /// The largest of x in units of what is allowed of a solution X, group by group, or of its rounding.
  double measure(const Eigen::MatrixXd& x, const Eigen::MatrixXd& X, double tolerance) const;

  const HandEquations& eq_;
  const RadauScheme& scheme_;
  int s_, n_;
  double h_ = 0;
  Way way_ = Way::apart;
  int together_for_ = 0;  // steps for which the mean is not tried again
  long factorizations_ = 0, corrections_ = 0;
  double factored_h_ = 0;    // of the factors, 0 where there are none
  bool fresh_ = false;       // they are of this step
  double slowest_rate_ = 0;  // of what corrections have left of errors since they were made
  double rate_ = 1;          // and of the last ones of this step
  std::vector<std::vector<double>> A_, D_;
  std::vector<char> in_D_;         // entries of the pattern that D has had
  std::vector<std::size_t> D_at_;  // these
  std::vector<int> column_;        // of each entry

  std::unique_ptr<KluSolver> real_;
  /// Of a pair of conjugates.
  struct Complex {
    std::complex<double> shift, step;  // h/shift
    ComplexKluSolver solver;
    std::vector<std::complex<double>> values, right;
  };
  std::vector<Complex> complex_;
  std::vector<double> mean_A_, mean_D_, values_;
  Eigen::VectorXd real_right_;
  Eigen::MatrixXd flow_;
  Eigen::ArrayXd row_scale_, column_scale_;
  Eigen::MatrixXd given_, left_, change_;

  // All stages in one matrix, made where it is needed.
  std::unique_ptr<BlockMatrix> matrix_;
  std::unique_ptr<KluSolver> together_;
  SparsePattern differential_rows_;            // the equations' pattern without algebraic rows
  std::vector<std::int64_t> differential_of_;  // positions of its entries in the full pattern
  Eigen::MatrixXi block_;
  std::vector<double> part_, scaled_;
  Eigen::ArrayXd all_rows_scale_, all_columns_scale_;
};

}  // namespace costate
