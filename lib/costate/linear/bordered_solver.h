// Direct solver for a sparse matrix whose unknowns fall into small groups that only the others, its border, link: a KKT
// matrix, where bodies are groups and joints their border. With blocks B_g of the groups, E_g and F_g between them and
// the border, and D of the border,
//   P_g B_g = L_g U_g,   Y_g = L_g^-1 P_g E_g,   X_g = F_g U_g^-1,   S = D - sum of X_g Y_g.
// Blocks are full, with row exchanges; so is S where it is small, else it is KLU's. What cancels in S is lost: factors
// whose pivots, of a matrix that is scaled symmetrically, are small are not kept, and the caller takes another solver.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "costate/linear/klu_solver.h"
#include "costate/linear/sparse_pattern.h"

namespace costate {

class BorderedSolver {
 public:
  /// group[i] >= 0 of unknown i, or -1 in the border.
  BorderedSolver(const SparsePattern& pattern, const std::vector<int>& group);

  /// Values on the pattern. False where an entry between two groups is not 0, or a pivot is too small, relative to
  /// entries scaled to 1: there are no factors then.
  [[nodiscard]] bool factor(const double* values);
  /// Where factor() was false: the groups with too small a pivot; none where it was the border's.
  const std::vector<int>& weak_groups() const { return weak_; }
  /// The next factor() chooses the scaling from its own values, so that results no longer depend on earlier ones.
  void forget_scale() { scaled_ = false; }
  /// In place, `columns` right-hand sides one after the other.
  void solve(double* b, int columns = 1) { solve_either(b, columns, false); }
  void solve_transposed(double* b, int columns = 1) { solve_either(b, columns, true); }
  /// The same of one right-hand side, corrected once by what it leaves of the equations: S squares the condition of
  /// what joints do to bodies, errors are 1e-13 and now 1e-15 on the full vehicle. `values`: those of the factors.
  void solve_refined(const double* values, double* b);

  /// Factors can be kept outside, `saved_size` numbers, and brought back as long as the scaling has this number.
  long scaling() const { return scaling_; }
  std::size_t saved_size() const;
  void save(double* to) const;
  [[nodiscard]] bool restore(long scaling, const double* from);
  void keep_pivot_orders(int at_most) {
    if (sparse_) sparse_->keep_pivot_orders(at_most);
  }

 private:
  struct Group {
    int size = 0;
    std::size_t first = 0;            // of unknown_
    std::vector<int> border = {};     // the rows of S that it links
    std::size_t block = 0, left = 0;  // in data_: L U and Y, column by column; X^T
  };
  struct Entry {
    std::size_t entry, place;  // of the pattern; in data_
    double scale = 1;
  };
  void choose_scale(const double* values);
  void solve_either(double* b, int columns, bool transposed);
  void solve_border(double* s, bool transposed);
  std::size_t saved_numbers() const;
  std::size_t saved_pivots() const;

  const SparsePattern& pattern_;
  std::vector<Group> groups_;
  std::size_t border_ = 0, rows_ = 0;  // where it begins in unknown_; of S
  std::vector<std::size_t> unknown_;   // group by group, then the border's
  std::vector<Entry> entries_;
  std::vector<std::size_t> between_;  // entries between two groups
  std::vector<double> scale_;         // of unknowns, powers of two
  std::vector<double> data_;          // blocks, then S
  std::vector<int> pivots_;           // exchanges of rows, as unknown_
  std::size_t border_block_ = 0;
  SparsePattern border_pattern_;       // of S
  std::vector<std::size_t> products_;  // of each group's pairs, group by group, the place of S
  std::unique_ptr<KluSolver> sparse_;  // of S; or null
  std::vector<double> work_, given_, left_;
  std::vector<int> weak_;
  bool scaled_ = false;
  long scaling_ = 0;
};

}  // namespace costate
