#include "costate/linear/klu_solver.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "costate/linear/klu_factors.h"

namespace costate {

namespace {
// From so many entries a column on, the ordering decides what a factorization costs: on the stage matrices of the full
// vehicle the default needs 1.4 times the operations of the best one for the adjoint of index 1, 3 times for that of
// index 2.
constexpr std::int64_t kManyEntries = 30;
}  // namespace

struct KluSolver::Impl : KluFactors<RealKlu> {
  using KluFactors::KluFactors;
  // Factorizations with earlier pivot orders, oldest first, and their orders' numbers.
  struct Earlier {
    long order;
    klu_l_numeric* numeric;
    double full_growth;
  };
  std::vector<Earlier> earlier;
  std::size_t earlier_at_most = 0;

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
  }
};

KluSolver::KluSolver(const SparsePattern& pattern)
    : impl_(std::make_unique<Impl>(pattern, pattern.entries() > kManyEntries * pattern.cols)) {}

KluSolver::~KluSolver() = default;
KluSolver::KluSolver(KluSolver&&) noexcept = default;
KluSolver& KluSolver::operator=(KluSolver&&) noexcept = default;

int KluSolver::factor(const double* values) {
  Impl& s = *impl_;
  if (s.pattern->cols == 0) return -1;
  ++counters_.factorizations;
  double* x = const_cast<double*>(values);
  s.choose_ordering(x);
  if (std::exchange(keep_pivots_, true) && s.refactor(x)) return -1;
  s.retire(order_);
  order_ = ++counters_.full;
  return s.factor(x);
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
