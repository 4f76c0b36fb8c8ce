#include "costate/linear/klu_solver.h"

#include <klu.h>

#include <algorithm>
#include <new>
#include <utility>
#include <vector>

#include "costate/base/error.h"

namespace costate {

namespace {
// A refactorisation is kept while the reciprocal pivot growth stays within this factor of that of the last
// full factorisation; KLU's growth is 1 for perfect pivots.
constexpr double kGrowthLoss = 1e-3;
// Below this reciprocal condition estimate of the diagonal of U the matrix counts as singular.
constexpr double kSingular = 1e-15;
// From so many entries a column on, the ordering decides what a factorization costs: on the stage matrices of the full
// vehicle the default needs 1.4 times the operations of the best one for the adjoint of index 1, 3 times for that of
// index 2.
constexpr std::int64_t kManyEntries = 30;
// KLU's orderings (0: AMD, 1: COLAMD), with and without a block triangular form in front. By default the first.
struct Ordering {
  int ordering, btf;
};
constexpr Ordering kOrderings[] = {{0, 1}, {0, 0}, {1, 0}};
}  // namespace

struct KluSolver::Impl {
  const SparsePattern* pattern = nullptr;
  klu_l_common common{};
  klu_l_symbolic* symbolic = nullptr;
  klu_l_numeric* numeric = nullptr;
  double full_growth = 1;
  bool ordering_open = false;
  // Factorizations with earlier pivot orders, oldest first, and their orders' numbers.
  struct Earlier {
    long order;
    klu_l_numeric* numeric;
    double full_growth;
  };
  std::vector<Earlier> earlier;
  std::size_t earlier_at_most = 0;

  SuiteSparse_long* starts() const {
    return reinterpret_cast<SuiteSparse_long*>(const_cast<std::int64_t*>(pattern->column_start.data()));
  }
  SuiteSparse_long* rows() const {
    return reinterpret_cast<SuiteSparse_long*>(const_cast<std::int64_t*>(pattern->row.data()));
  }
  /// The present factorization joins the earlier ones, or is freed.
  void retire(long order) {
    if (!numeric) return;
    earlier.push_back({order, std::exchange(numeric, nullptr), full_growth});
    discard();
  }
  void discard() {
    while (earlier.size() > earlier_at_most) {
      klu_l_free_numeric(&earlier.front().numeric, &common);
      earlier.erase(earlier.begin());
    }
  }
  void analyze(Ordering o) {
    common.ordering = o.ordering;
    common.btf = o.btf;
    symbolic = klu_l_analyze(pattern->cols, starts(), rows(), &common);
  }
  /// With dense columns, the ordering whose factors of these values are the sparsest.
  void choose_ordering(double* values) {
    if (!std::exchange(ordering_open, false)) return;
    SuiteSparse_long fewest = -1;
    klu_l_symbolic* best = nullptr;
    for (const Ordering o : kOrderings) {
      if (!symbolic) analyze(o);
      klu_l_numeric* trial = symbolic ? klu_l_factor(starts(), rows(), values, symbolic, &common) : nullptr;
      const bool regular = trial && common.status == KLU_OK;
      if (regular && (fewest < 0 || trial->lnz + trial->unz < fewest)) {
        fewest = trial->lnz + trial->unz;
        std::swap(best, symbolic);
      }
      if (trial) klu_l_free_numeric(&trial, &common);
      if (symbolic) klu_l_free_symbolic(&symbolic, &common);
    }
    symbolic = best;
    if (!symbolic) analyze(kOrderings[0]);  // singular in all of them, as factor() will find
  }
  /// The numbers of a factorization without its indices, one array after the other: f(array, count). A column of L or U
  /// lies in its block as `length` indices followed by `length` numbers.
  template <class F>
  void for_each_array(F&& f) const {
    const auto n = static_cast<std::size_t>(pattern->cols);
    for (SuiteSparse_long b = 0; b < numeric->nblocks; ++b) {
      auto* const block = static_cast<double*>(numeric->LUbx[b]);
      if (!block) continue;
      for (SuiteSparse_long k = symbolic->R[b]; k < symbolic->R[b + 1]; ++k) {
        f(block + numeric->Lip[k] + numeric->Llen[k], static_cast<std::size_t>(numeric->Llen[k]));
        f(block + numeric->Uip[k] + numeric->Ulen[k], static_cast<std::size_t>(numeric->Ulen[k]));
      }
    }
    f(static_cast<double*>(numeric->Udiag), n);
    if (numeric->nzoff > 0) f(static_cast<double*>(numeric->Offx), static_cast<std::size_t>(numeric->nzoff));
    if (numeric->Rs) f(numeric->Rs, n);
  }
  ~Impl() {
    for (Earlier& e : earlier) klu_l_free_numeric(&e.numeric, &common);
    if (numeric) klu_l_free_numeric(&numeric, &common);
    if (symbolic) klu_l_free_symbolic(&symbolic, &common);
  }
};

static_assert(sizeof(SuiteSparse_long) == sizeof(std::int64_t) && sizeof(double) == sizeof(std::int64_t));

KluSolver::KluSolver(const SparsePattern& pattern) : impl_(std::make_unique<Impl>()) {
  impl_->pattern = &pattern;
  klu_l_defaults(&impl_->common);
  impl_->common.halt_if_singular = 1;
  // Diagonal entries serve as pivots only down to this fraction of their column. KLU's own 1e-3 is for matrices with a
  // strong diagonal; in saddle matrices it costs two to three digits.
  impl_->common.tol = 0.1;
  if (pattern.cols == 0) return;
  impl_->analyze(kOrderings[0]);
  impl_->ordering_open = pattern.entries() > kManyEntries * pattern.cols;
  if (!impl_->symbolic) throw Error("The sparse solver could not analyse a matrix (structurally singular?).");
}

KluSolver::~KluSolver() = default;
KluSolver::KluSolver(KluSolver&&) noexcept = default;
KluSolver& KluSolver::operator=(KluSolver&&) noexcept = default;

int KluSolver::factor(const double* values) {
  Impl& s = *impl_;
  if (s.pattern->cols == 0) return -1;
  ++counters_.factorizations;
  double* x = const_cast<double*>(values);
  s.choose_ordering(x);
  if (std::exchange(keep_pivots_, true) && s.numeric &&
      klu_l_refactor(s.starts(), s.rows(), x, s.symbolic, s.numeric, &s.common) && s.common.status == KLU_OK) {
    if (klu_l_rgrowth(s.starts(), s.rows(), x, s.symbolic, s.numeric, &s.common) &&
        s.common.rgrowth > kGrowthLoss * s.full_growth)
      return -1;
  }
  s.retire(order_);
  order_ = ++counters_.full;
  s.numeric = klu_l_factor(s.starts(), s.rows(), x, s.symbolic, &s.common);
  if (!s.numeric || s.common.status != KLU_OK) {
    const auto column = s.common.singular_col;
    if (s.numeric) klu_l_free_numeric(&s.numeric, &s.common);
    return column >= 0 && column < s.pattern->cols ? static_cast<int>(column) : 0;
  }
  if (klu_l_rgrowth(s.starts(), s.rows(), x, s.symbolic, s.numeric, &s.common)) s.full_growth = s.common.rgrowth;
  if (klu_l_rcond(s.symbolic, s.numeric, &s.common) && !(s.common.rcond > kSingular)) {
    const auto column = s.common.singular_col;
    return column >= 0 && column < s.pattern->cols ? static_cast<int>(column) : 0;
  }
  return -1;
}

void KluSolver::solve(double* b, int columns) {
  Impl& s = *impl_;
  if (s.pattern->cols == 0) return;
  ++counters_.solves;
  klu_l_solve(s.symbolic, s.numeric, s.pattern->cols, columns, b, &s.common);
}

void KluSolver::solve_transposed(double* b, int columns) {
  Impl& s = *impl_;
  if (s.pattern->cols == 0) return;
  ++counters_.solves;
  klu_l_tsolve(s.symbolic, s.numeric, s.pattern->cols, columns, b, &s.common);
}

std::size_t KluSolver::saved_size() const {
  if (!impl_->numeric) return 0;
  const klu_l_numeric& x = *impl_->numeric;
  // The counts of L and U include both diagonals, of which one is kept.
  return static_cast<std::size_t>(x.lnz + x.unz - x.n + x.nzoff + (x.Rs ? x.n : 0));
}

void KluSolver::save(double* to) const {
  if (!impl_->numeric) return;
  impl_->for_each_array([&](const double* x, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) to[i] = x[i];
    to += count;
  });
}

bool KluSolver::restore(long pivot_order, const double* from) {
  Impl& s = *impl_;
  if (s.pattern->cols == 0) return true;
  if (pivot_order != order_ || !s.numeric) {
    const auto at = std::find_if(s.earlier.begin(), s.earlier.end(),
                                 [&](const Impl::Earlier& e) { return e.order == pivot_order; });
    if (at == s.earlier.end()) return false;
    if (s.numeric) {
      std::swap(at->numeric, s.numeric);
      std::swap(at->full_growth, s.full_growth);
      std::swap(at->order, order_);
    } else {
      s.numeric = at->numeric;
      s.full_growth = at->full_growth;
      order_ = at->order;
      s.earlier.erase(at);
    }
  }
  s.for_each_array([&](double* x, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) x[i] = from[i];
    from += count;
  });
  return true;
}

void KluSolver::keep_pivot_orders(int at_most) {
  impl_->earlier_at_most = at_most > 1 ? static_cast<std::size_t>(at_most - 1) : 0;
  impl_->earlier.reserve(impl_->earlier_at_most + 1);
  impl_->discard();
}

}  // namespace costate
