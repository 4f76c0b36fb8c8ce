// Direct solver for KKT matrices: by the groups of its unknowns (linear/bordered_solver.h) as long as their pivots
// allow it, else by KLU, which also says what is dependent where the matrix is singular.
#pragma once

#include <memory>
#include <vector>

#include "costate/linear/bordered_solver.h"

namespace costate {

class KktSolver {
 public:
  /// The pattern must outlive the solver. Groups as of BorderedSolver; none: KLU alone.
  KktSolver(const SparsePattern& pattern, const std::vector<int>& group);

  /// Values on the pattern. Returns -1, or the index of a column found (numerically) dependent.
  [[nodiscard]] int factor(const double* values);
  /// The next factor() takes nothing over from earlier ones.
  void forget_pivots();
  /// In place, `columns` right-hand sides one after the other.
  void solve(double* b, int columns = 1) { by_groups_ ? grouped_->solve(b, columns) : sparse().solve(b, columns); }
  void solve_transposed(double* b, int columns = 1) {
    by_groups_ ? grouped_->solve_transposed(b, columns) : sparse().solve_transposed(b, columns);
  }

  long factorizations() const { return factorizations_; }
  /// Of those KLU's.
  long sparse_factorizations() const { return sparse_ ? sparse_->counters().factorizations : 0; }

  // As of KluSolver: factors kept outside, brought back by the number of their pivot order, which is not 0.
  std::size_t saved_size() const { return by_groups_ ? grouped_->saved_size() : sparse_ ? sparse_->saved_size() : 0; }
  long pivot_order() const { return by_groups_ ? -grouped_->scaling() : sparse_ ? sparse_->pivot_order() : 0; }
  void save(double* to) const {
    if (by_groups_)
      grouped_->save(to);
    else if (sparse_)
      sparse_->save(to);
  }
  [[nodiscard]] bool restore(long pivot_order, const double* from);
  void keep_pivot_orders(int at_most);

 private:
  KluSolver& sparse();

  const SparsePattern& pattern_;
  std::unique_ptr<BorderedSolver> grouped_;
  std::unique_ptr<KluSolver> sparse_;  // where it was needed
  bool by_groups_ = false;
  int refused_ = 0;  // in a row
  int kept_orders_ = 1;
  long factorizations_ = 0;
};

}  // namespace costate
