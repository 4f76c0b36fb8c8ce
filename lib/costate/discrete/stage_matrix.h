// The matrix of a Radau IIA step with one Jacobian J for all stages, (w (x) E)/h + I (x) J with E the differential
// unknowns. With w = T diag(shift) T^-1 it falls apart into E shift/h + J: one real matrix where the number of stages
// is odd, and one complex matrix for each pair of conjugates, each of the size of the system.
#pragma once

#include <memory>
#include <vector>

#include "costate/discrete/radau_scheme.h"
#include "costate/linear/complex_klu_solver.h"
#include "costate/linear/klu_solver.h"

namespace costate {

class StageMatrix {
 public:
  /// The pattern has all diagonal entries of differential unknowns, and outlives this; so does the scheme.
  StageMatrix(const RadauScheme& scheme, const SparsePattern& jacobian, std::vector<char> differential);

  /// J on the pattern. Returns -1, or a column found (numerically) dependent.
  [[nodiscard]] int factor(const double* J, double h);
  /// In place, of all stages one after the other.
  void solve(double* x);
  void solve_transposed(double* x);
  /// x := (E filter/h + J)^-1 x, of one stage; asked for after factor().
  void filter(double* x);
  const std::vector<char>& differential() const { return differential_; }
  long factorizations() const;

  // What factor() has made can be kept outside (`saved_size` numbers), and brought back for further solves.
  std::size_t saved_size() const;
  void save(double* to) const;
  /// False when its pivot order has been discarded; what there was is no longer whole then.
  [[nodiscard]] bool restore(const double* from);

 private:
  bool has_real() const { return scheme_.shift.front().imag() == 0; }
  [[nodiscard]] int factor_real(double shift, KluSolver& solver);
  void scale_rows(double h);
  /// x := T sum of (E shift/h + J)^-1 (T^-1 x), or with both transposed.
  void solve_apart(double* x, bool transposed);
  /// The same with the number of stages known where the loops are compiled.
  template <int stages>
  void solve_stages(double* x, bool transposed);

  const RadauScheme& scheme_;
  const SparsePattern& pattern_;
  std::vector<char> differential_;
  int n_;
  std::vector<std::int64_t> diagonal_;  // positions of the differential unknowns' entries
  std::unique_ptr<KluSolver> real_;     // also of the filter
  std::vector<ComplexKluSolver> complex_;
  double h_ = 0;
  bool filter_ready_ = false;
  std::vector<double> scaled_;                 // J, rows and columns scaled
  std::vector<double> row_scale_, col_scale_;  // differential rows by h, columns to size 1
  std::vector<double> values_, parts_;
  std::vector<std::complex<double>> complex_values_, complex_right_;
};

}  // namespace costate
