// Direct solver for KKT matrices: by the groups of its unknowns (linear/bordered_solver.h) as long as their pivots
// allow it, else by KLU, which also says what is dependent where the matrix is singular. A group whose own block is
// singular, a body without inertia about an axis that a joint holds, is one with its neighbour.
#pragma once

#include <memory>
#include <vector>

#include "costate/linear/bordered_solver.h"

namespace costate {

class KktSolver {
 public:
  /// Unknowns of a group at the most.
  static constexpr int kLargestGroup = 24;

  /// The pattern must outlive the solver. Groups as of BorderedSolver; none: KLU alone.
  KktSolver(const SparsePattern& pattern, std::vector<int> group);

  /// Values on the pattern. Returns -1, or the index of a column found (numerically) dependent.
  [[nodiscard]] int factor(const double* values);
  /// The next factor() takes nothing over from earlier ones.
  void forget_pivots();
  /// In place, `columns` right-hand sides one after the other.
  void solve(double* b, int columns = 1) { by_groups_ ? grouped().solve(b, columns) : sparse().solve(b, columns); }
  /// The same of one right-hand side, as exactly by groups as by row exchanges; `values` are those of factor().
  void solve_refined(const double* values, double* b) {
    by_groups_ ? grouped().solve_refined(values, b) : sparse().solve(b);
  }
  void solve_transposed(double* b, int columns = 1) {
    by_groups_ ? grouped().solve_transposed(b, columns) : sparse().solve_transposed(b, columns);
  }

  long factorizations() const { return factorizations_; }
  /// Of those KLU's.
  long sparse_factorizations() const { return sparse_ ? sparse_->counters().factorizations : 0; }

  // As of KluSolver: factors kept outside, brought back by the number of their pivot order, which is not 0.
  std::size_t saved_size() const;
  long pivot_order() const;
  void save(double* to) const;
  [[nodiscard]] bool restore(long pivot_order, const double* from);
  void keep_pivot_orders(int at_most);

 private:
  /// Groups, and those of them that were found weak, which the next ones have merged.
  struct Grouping {
    std::vector<int> group;
    std::unique_ptr<BorderedSolver> solver;
    std::vector<int> weak = {};
  };
  KluSolver& sparse();
  BorderedSolver& grouped() { return *groupings_[at_].solver; }
  const BorderedSolver& grouped() const { return *groupings_[at_].solver; }
  bool add(std::vector<int> group);
  /// Goes on to the grouping in which the weak ones of the present one are merged; false: there is none.
  bool merge_weak();

  const SparsePattern& pattern_;
  std::vector<Grouping> groupings_;
  std::size_t at_ = 0;
  std::unique_ptr<KluSolver> sparse_;  // where it was needed
  bool by_groups_ = false;
  int refused_ = 0;  // in a row
  int kept_orders_ = 1;
  long factorizations_ = 0;
};

}  // namespace costate
