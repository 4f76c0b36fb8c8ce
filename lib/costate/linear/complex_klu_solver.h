// KLU for complex matrices on a fixed pattern: analysed once, factored often on old pivots, whose growth is watched as
// in klu_solver.h.
#pragma once

#include <complex>
#include <memory>

#include "costate/linear/sparse_pattern.h"

namespace costate {

class ComplexKluSolver {
 public:
  /// The pattern must outlive the solver.
  explicit ComplexKluSolver(const SparsePattern& pattern);
  ~ComplexKluSolver();
  ComplexKluSolver(ComplexKluSolver&&) noexcept;

  /// Values on the pattern. Returns -1, or the index of a column found (numerically) dependent.
  [[nodiscard]] int factor(const std::complex<double>* values);
  /// In place; transposed without conjugation.
  void solve(std::complex<double>* b);
  void solve_transposed(std::complex<double>* b);

  long factorizations() const { return factorizations_; }

  // Kept outside and brought back, as in klu_solver.h.
  std::size_t saved_size() const;
  long pivot_order() const { return order_; }
  void save(double* to) const;
  [[nodiscard]] bool restore(long pivot_order, const double* from);
  void keep_pivot_orders(int at_most);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  long factorizations_ = 0, order_ = 0, orders_ = 0;
};

}  // namespace costate
