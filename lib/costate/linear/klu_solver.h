// Sparse direct solver (SuiteSparse KLU): analyse once, factor often on old pivots, and watch those pivots.
// KLU re-uses the old pivot order on refactorisation, where a bad pivot would spoil the solve quietly; the
// reciprocal pivot growth is checked after each and a full factorisation is made when it drops.
#pragma once

#include <memory>
#include <string>

#include "costate/linear/sparse_pattern.h"

namespace costate {

struct LinearCounters {
  long factorizations = 0;  // all numeric ones
  long full = 0;            // of these, with a new pivot order
  long solves = 0;
};

class KluSolver {
 public:
  /// The pattern must outlive the solver.
  explicit KluSolver(const SparsePattern& pattern);
  ~KluSolver();
  KluSolver(KluSolver&&) noexcept;
  KluSolver& operator=(KluSolver&&) noexcept;

  /// Values on the pattern. Returns -1, or the index of a column found (numerically) dependent.
  [[nodiscard]] int factor(const double* values);
  /// The next factor() chooses its pivots from its own values, so that results no longer depend on earlier ones.
  void forget_pivots() { keep_pivots_ = false; }
  /// In place, `columns` right-hand sides of length n one after the other.
  void solve(double* b, int columns = 1);
  void solve_transposed(double* b, int columns = 1);

  const LinearCounters& counters() const { return counters_; }
  /// Of the present factors: the smallest diagonal entry of U over the largest, of a matrix whose rows are scaled.
  double pivot_ratio();

  // A factorization can be kept outside (`saved_size` numbers) and brought back for further solves. Its structure stays
  // here, under the number of its pivot order: the last `at_most` orders are kept, by default only the present one.
  std::size_t saved_size() const;
  long pivot_order() const { return order_; }
  void save(double* to) const;
  /// False when that pivot order has been discarded; the present factorization then stays.
  [[nodiscard]] bool restore(long pivot_order, const double* from);
  void keep_pivot_orders(int at_most);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  LinearCounters counters_;
  long order_ = 0;
  bool keep_pivots_ = true;
};

}  // namespace costate
