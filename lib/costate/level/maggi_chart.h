// One choice of independent coordinates for Maggi's equations (lib/README.md (5)): with B the selection of f = n - r
// coordinates that leaves [Phi_q; B] of full column rank,
//   [Phi_q; B]^-1 = [S R],   Phi_q R = 0,  B R = 1,  Phi_q S = 1,  B S = 0.
// R spans the motions that the constraints allow, S gives the reactions. With redundant rows (m > r) the inverse is
// the pseudo-inverse: Phi_q S then projects on the range of Phi_q, and S^T gives reactions of least norm.
//
// Rows that come and go (element/switched_rows.h) are rows of zeros where they are not there. Each has an unknown of
// its own then, 0 on the solution, so that [Phi_q; B] stays square; its entries of S^T x are 0. Where they are there f
// is smaller: what is missing stands behind the independent coordinates as places that move nothing (maggi_rows.h).
#pragma once

#include <memory>
#include <vector>

#include "costate/linear/klu_solver.h"
#include "costate/linear/sparse_pattern.h"

namespace costate {

class MaggiChart {
 public:
  /// `jacobian`: the pattern of Phi_q (m x n), which must outlive the chart; `independent`: f coordinates; `absent`:
  /// the rows that are not there, without which no other rows depend on each other; `places` stand behind B's rows.
  MaggiChart(const SparsePattern& jacobian, std::vector<int> independent, std::vector<int> absent = {}, int places = 0);
  MaggiChart(const MaggiChart&) = delete;
  MaggiChart& operator=(const MaggiChart&) = delete;

  const std::vector<int>& independent() const { return independent_; }
  const std::vector<int>& absent() const { return absent_; }
  /// m + f and places: the length of right-hand sides below, n without redundant rows and rows that come and go.
  int rows() const { return m_ + f_ + places_; }
  bool redundant() const { return m_ + f_ > n_ + static_cast<int>(absent_.size()); }

  /// Takes and factors [Phi_q; B]; false when it is singular.
  [[nodiscard]] bool factor(const double* phi_q);
  /// The next factor() does not depend on earlier ones.
  void forget_history() { solver_->forget_pivots(); }
  /// b: rows() numbers [c; d] a column; becomes x = S c + R d in its first n entries. Places are left as they are.
  void solve(double* b, int columns = 1);
  /// x: n numbers, with room for rows(); becomes [S^T x; R^T x].
  void solve_transposed(double* x);
  /// (X^T X)^-1 x for X = [Phi_q; B] and the x of the last solve_transposed(); only with redundant rows.
  const double* normal_solution() const { return buffer_.data() + m_ + f_; }

  long factorizations() const { return solver_->counters().factorizations; }

 private:
  void solve_least_squares(double* b);
  void add_residual(const double* b, const double* x, double* r) const;

  const SparsePattern& jacobian_;
  std::vector<int> independent_, absent_;
  int n_, m_, f_, places_;
  SparsePattern selection_;
  BlockMatrix matrix_;  // X, or [[1, X], [X^T, 0]] with redundant rows
  int jacobian_block_ = -1, selection_block_ = -1, transposed_jacobian_ = -1, transposed_selection_ = -1,
      identity_ = -1, absent_block_ = -1;
  std::unique_ptr<KluSolver> solver_;
  std::vector<double> phi_q_, buffer_, correction_;
};

}  // namespace costate
