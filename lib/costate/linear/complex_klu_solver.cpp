#include "costate/linear/complex_klu_solver.h"

#include <klu.h>

#include <limits>
#include <utility>

#include "costate/base/error.h"

namespace costate {

namespace {
// As for real matrices (klu_solver.cpp).
// Of the orderings (AMD with and without a block triangular form in front, COLAMD) a system of this size takes the one
// whose factors are the sparsest.
constexpr int kManyUnknowns = 60;
constexpr double kComplexGrowthLoss = 1e-3, kComplexSingular = 1e-15, kComplexDiagonal = 0.1;
}  // namespace

struct ComplexKluSolver::Impl {
  const SparsePattern* pattern = nullptr;
  klu_l_common common{};
  klu_l_symbolic* symbolic = nullptr;
  klu_l_numeric* numeric = nullptr;
  double full_growth = 1;

  SuiteSparse_long* starts() const {
    return reinterpret_cast<SuiteSparse_long*>(const_cast<std::int64_t*>(pattern->column_start.data()));
  }
  SuiteSparse_long* rows() const {
    return reinterpret_cast<SuiteSparse_long*>(const_cast<std::int64_t*>(pattern->row.data()));
  }
  void analyze(int ordering, int btf) {
    common.ordering = ordering;
    common.btf = btf;
    symbolic = klu_l_analyze(pattern->cols, starts(), rows(), &common);
  }
  void choose_ordering(double* x) {
    constexpr std::pair<int, int> kOthers[] = {{0, 0}, {1, 0}};
    const auto entries = [&]() -> SuiteSparse_long {
      klu_l_numeric* trial = symbolic ? klu_zl_factor(starts(), rows(), x, symbolic, &common) : nullptr;
      const bool regular = trial && common.status == KLU_OK;
      const SuiteSparse_long count = regular ? trial->lnz + trial->unz : std::numeric_limits<SuiteSparse_long>::max();
      if (trial) klu_zl_free_numeric(&trial, &common);
      return count;
    };
    SuiteSparse_long fewest = entries();
    for (const auto& [ordering, btf] : kOthers) {
      klu_l_symbolic* best = std::exchange(symbolic, nullptr);
      analyze(ordering, btf);
      const SuiteSparse_long count = entries();
      if (count < fewest)
        fewest = count;
      else
        std::swap(best, symbolic);
      if (best) klu_l_free_symbolic(&best, &common);
    }
  }
  void drop() {
    if (numeric) klu_zl_free_numeric(&numeric, &common);
  }
  ~Impl() {
    drop();
    if (symbolic) klu_l_free_symbolic(&symbolic, &common);
  }
};

ComplexKluSolver::ComplexKluSolver(const SparsePattern& pattern) : impl_(std::make_unique<Impl>()) {
  impl_->pattern = &pattern;
  klu_l_defaults(&impl_->common);
  impl_->common.halt_if_singular = 1;
  impl_->common.tol = kComplexDiagonal;
  if (pattern.cols == 0) return;
  impl_->analyze(0, 1);
  if (!impl_->symbolic) throw Error("The sparse solver could not analyse a matrix (structurally singular?).");
}

ComplexKluSolver::~ComplexKluSolver() = default;
ComplexKluSolver::ComplexKluSolver(ComplexKluSolver&&) noexcept = default;

int ComplexKluSolver::factor(const std::complex<double>* values) {
  Impl& s = *impl_;
  if (s.pattern->cols == 0) return -1;
  if (factorizations_++ == 0 && s.pattern->cols >= kManyUnknowns)
    s.choose_ordering(const_cast<double*>(reinterpret_cast<const double*>(values)));
  // KLU takes real and imaginary parts one behind the other, as std::complex has them.
  double* x = const_cast<double*>(reinterpret_cast<const double*>(values));
  if (s.numeric && klu_zl_refactor(s.starts(), s.rows(), x, s.symbolic, s.numeric, &s.common) &&
      s.common.status == KLU_OK && klu_zl_rgrowth(s.starts(), s.rows(), x, s.symbolic, s.numeric, &s.common) &&
      s.common.rgrowth > kComplexGrowthLoss * s.full_growth)
    return -1;
  s.drop();
  const auto dependent = [&] {
    const auto column = s.common.singular_col;
    return column >= 0 && column < s.pattern->cols ? static_cast<int>(column) : 0;
  };
  s.numeric = klu_zl_factor(s.starts(), s.rows(), x, s.symbolic, &s.common);
  if (!s.numeric || s.common.status != KLU_OK) {
    s.drop();
    return dependent();
  }
  if (klu_zl_rgrowth(s.starts(), s.rows(), x, s.symbolic, s.numeric, &s.common)) s.full_growth = s.common.rgrowth;
  if (klu_zl_rcond(s.symbolic, s.numeric, &s.common) && !(s.common.rcond > kComplexSingular)) return dependent();
  return -1;
}

void ComplexKluSolver::solve(std::complex<double>* b) {
  Impl& s = *impl_;
  if (s.pattern->cols == 0) return;
  klu_zl_solve(s.symbolic, s.numeric, s.pattern->cols, 1, reinterpret_cast<double*>(b), &s.common);
}

void ComplexKluSolver::solve_transposed(std::complex<double>* b) {
  Impl& s = *impl_;
  if (s.pattern->cols == 0) return;
  klu_zl_tsolve(s.symbolic, s.numeric, s.pattern->cols, 1, reinterpret_cast<double*>(b), 0, &s.common);
}

}  // namespace costate
