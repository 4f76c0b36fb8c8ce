// KLU's analysis and factors of one matrix on a fixed pattern, for real and for complex numbers: the ordering, the
// refactorization on old pivots with its watch over their growth, the full factorization. Within klu_solver.cpp and
// complex_klu_solver.cpp.
#pragma once

#include <klu.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "costate/base/error.h"
#include "costate/linear/balancing_scale.h"
#include "costate/linear/sparse_pattern.h"

namespace costate {

static_assert(sizeof(SuiteSparse_long) == sizeof(std::int64_t) && sizeof(double) == sizeof(std::int64_t));

/// KLU's functions for real numbers.
struct RealKlu {
  static constexpr long numbers = 1;  // of an entry
  static constexpr auto factor = klu_l_factor;
  static constexpr auto refactor = klu_l_refactor;
  static constexpr auto growth = klu_l_rgrowth;
  static constexpr auto condition = klu_l_rcond;
  static constexpr auto solve = klu_l_solve;
  static constexpr auto free = klu_l_free_numeric;
};

/// And for complex ones: real and imaginary parts one behind the other, as std::complex has them.
struct ComplexKlu {
  static constexpr long numbers = 2;
  static constexpr auto factor = klu_zl_factor;
  static constexpr auto refactor = klu_zl_refactor;
  static constexpr auto growth = klu_zl_rgrowth;
  static constexpr auto condition = klu_zl_rcond;
  static constexpr auto solve = klu_zl_solve;
  static constexpr auto free = klu_zl_free_numeric;
};

template <class Klu>
struct KluFactors {
  // A refactorization is kept while the reciprocal pivot growth stays within this factor of that of the last
  // full factorization; KLU's growth is 1 for perfect pivots.
  static constexpr double kGrowthLoss = 1e-3;
  // Below this reciprocal condition estimate of the diagonal of U the matrix may be singular: as it is, and with
  // columns balanced as well as KLU's rows. It is unless solutions can be refined: pivots may be small because of
  // scales that cannot all be balanced (an Euler parameter without inertia beside feet that are metres away).
  static constexpr double kSingular = 1e-15, kSingularBalanced = 1e-14;
  // By so much of itself a correction may change a solution that can: of a singular matrix by about all of it.
  static constexpr double kRefined = 1e-2;
  // Diagonal entries serve as pivots only down to this fraction of their column. KLU's own 1e-3 is for matrices with a
  // strong diagonal; in saddle matrices it costs two to three digits.
  static constexpr double kDiagonal = 0.1;
  // KLU's orderings (0: AMD, 1: COLAMD), with and without a block triangular form in front. By default the first.
  struct Ordering {
    int ordering, btf;
  };
  static constexpr Ordering kOrderings[] = {{0, 1}, {0, 0}, {1, 0}};

  const SparsePattern* pattern;
  klu_l_common common{};
  klu_l_symbolic* symbolic = nullptr;
  klu_l_numeric* numeric = nullptr;
  double full_growth = 1;
  std::vector<double> columns;  // what the columns of the factorized matrix were multiplied by; or none
  bool ordering_open;           // the first numbers choose it

  KluFactors(const SparsePattern& of, bool choose) : pattern(&of), ordering_open(choose) {
    klu_l_defaults(&common);
    common.halt_if_singular = 1;
    common.tol = kDiagonal;
    if (of.cols == 0) return;
    analyze(kOrderings[0]);
    if (!symbolic) throw Error("The sparse solver could not analyse a matrix (structurally singular?).");
  }
  KluFactors(const KluFactors&) = delete;
  KluFactors& operator=(const KluFactors&) = delete;
  ~KluFactors() {
    drop();
    if (symbolic) klu_l_free_symbolic(&symbolic, &common);
  }

  SuiteSparse_long* starts() const {
    return reinterpret_cast<SuiteSparse_long*>(const_cast<std::int64_t*>(pattern->column_start.data()));
  }
  SuiteSparse_long* rows() const {
    return reinterpret_cast<SuiteSparse_long*>(const_cast<std::int64_t*>(pattern->row.data()));
  }
  void drop() {
    if (numeric) Klu::free(&numeric, &common);
  }

  /// Where it is still open: the ordering whose factors of these numbers are the sparsest.
  void choose_ordering(double* values) {
    if (!std::exchange(ordering_open, false)) return;
    SuiteSparse_long fewest = -1;
    klu_l_symbolic* best = nullptr;
    for (const Ordering o : kOrderings) {
      if (!symbolic) analyze(o);
      klu_l_numeric* trial = symbolic ? Klu::factor(starts(), rows(), values, symbolic, &common) : nullptr;
      const bool regular = trial && common.status == KLU_OK;
      if (regular && (fewest < 0 || trial->lnz + trial->unz < fewest)) {
        fewest = trial->lnz + trial->unz;
        std::swap(best, symbolic);
      }
      if (trial) Klu::free(&trial, &common);
      if (symbolic) klu_l_free_symbolic(&symbolic, &common);
    }
    symbolic = best;
    if (!symbolic) analyze(kOrderings[0]);  // singular in all of them, as factor() will find
  }

  /// On the pivots of the present factors; false where there are none or they have become bad.
  bool refactor(double* values) {
    double* x = balanced(values);
    return numeric && Klu::refactor(starts(), rows(), x, symbolic, numeric, &common) && common.status == KLU_OK &&
           Klu::growth(starts(), rows(), x, symbolic, numeric, &common) && common.rgrowth > kGrowthLoss * full_growth;
  }

  /// Anew, after the present factors have been dropped or kept elsewhere. Returns -1, or the index of a column found
  /// (numerically) dependent.
  int factor(double* values) {
    columns.clear();
    const int column = factor_as_it_is(values, kSingular);
    if (column < 0) return -1;
    // Columns far smaller than others (multipliers beside large masses) have small pivots, and are not dependent.
    klu_l_numeric* plain = std::exchange(numeric, nullptr);
    const double growth = full_growth;
    columns = balancing_scale(*pattern, Balance::columns, [values](std::size_t k) {
      double size = 0;
      for (std::size_t part = 0; part < Klu::numbers; ++part)
        size = std::max(size, std::abs(values[Klu::numbers * k + part]));
      return size;
    });
    double* x = balanced(values);
    const bool regular = factor_as_it_is(x, kSingularBalanced) < 0 || (numeric && refines(x));
    if (!regular) {
      drop();
      columns.clear();
      std::swap(numeric, plain);
      full_growth = growth;
    }
    if (plain) Klu::free(&plain, &common);
    return regular ? -1 : column;
  }

  /// Of solutions of the factorized system those of the matrix itself, and of right-hand sides of its transpose. `b`:
  /// `count` of them, one after the other.
  void scale_by_columns(double* b, int count = 1) const {
    for (int k = 0; k < count && !columns.empty(); ++k)
      for (const double c : columns)
        for (long part = 0; part < Klu::numbers; ++part) *b++ *= c;
  }

 private:
  int factor_as_it_is(double* values, double singular) {
    numeric = Klu::factor(starts(), rows(), values, symbolic, &common);
    if (!numeric || common.status != KLU_OK) {
      const int column = dependent();
      drop();
      return column;
    }
    if (Klu::growth(starts(), rows(), values, symbolic, numeric, &common)) full_growth = common.rgrowth;
    return Klu::condition(symbolic, numeric, &common) && !(common.rcond > singular) ? dependent() : -1;
  }

  /// Whether a solution of A x = b, for some b of the rows' sizes, is corrected by little.
  bool refines(double* values) {
    const auto length = static_cast<std::size_t>(Klu::numbers * pattern->cols);
    std::vector<double> size(static_cast<std::size_t>(pattern->cols), 0), b(length), x, left;
    for_each_entry([&](std::size_t i, std::size_t, std::size_t k) {
      for (std::size_t part = 0; part < Klu::numbers; ++part)
        size[i] = std::max(size[i], std::abs(values[Klu::numbers * k + part]));
    });
    // Signs as good as random: no null direction is at a right angle to b.
    std::uint64_t seed = 88172645463325252u;
    for (std::size_t i = 0; i < length; ++i) {
      seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
      b[i] = (seed >> 40 & 1 ? 1 : -1) * size[i / Klu::numbers];
    }
    const auto solved = [&](std::vector<double> r) {
      Klu::solve(symbolic, numeric, pattern->cols, 1, r.data(), &common);
      return r;
    };
    const auto norm = [](const std::vector<double>& v) {
      double sum = 0;
      for (const double c : v) sum += c * c;
      return std::sqrt(sum);
    };
    left = b;
    x = solved(b);
    for_each_entry([&](std::size_t i, std::size_t j, std::size_t k) {
      const double* a = values + Klu::numbers * k;
      const double* u = &x[Klu::numbers * j];
      double* r = &left[Klu::numbers * i];
      if constexpr (Klu::numbers == 1) {
        *r -= *a * *u;
      } else {
        r[0] -= a[0] * u[0] - a[1] * u[1];
        r[1] -= a[0] * u[1] + a[1] * u[0];
      }
    });
    return norm(solved(left)) <= kRefined * norm(x);  // false of what is no number
  }
  /// Calls f(row, column, entry).
  template <class F>
  void for_each_entry(const F& f) const {
    std::size_t k = 0;
    for (std::size_t j = 0; j < static_cast<std::size_t>(pattern->cols); ++j)
      for (const auto end = static_cast<std::size_t>(pattern->column_start[j + 1]); k < end; ++k)
        f(static_cast<std::size_t>(pattern->row[k]), j, k);
  }

  /// The values with their columns multiplied, if they are.
  double* balanced(double* values) {
    if (columns.empty()) return values;
    balanced_.resize(static_cast<std::size_t>(Klu::numbers * pattern->entries()));
    auto k = std::size_t{0};
    for (std::size_t j = 0; j < columns.size(); ++j)
      for (const auto end = static_cast<std::size_t>(Klu::numbers * pattern->column_start[j + 1]); k < end; ++k)
        balanced_[k] = columns[j] * values[k];
    return balanced_.data();
  }

  std::vector<double> balanced_;

  void analyze(Ordering o) {
    common.ordering = o.ordering;
    common.btf = o.btf;
    symbolic = klu_l_analyze(pattern->cols, starts(), rows(), &common);
  }
  int dependent() const {
    const auto column = common.singular_col;
    return column >= 0 && column < pattern->cols ? static_cast<int>(column) : 0;
  }
};

}  // namespace costate
