#include "costate/linear/klu_solver.h"

#include <utility>

#include "costate/linear/kept_klu_factors.h"

namespace costate {

namespace {
// From so many entries a column on, the ordering decides what a factorization costs: on the stage matrices of the full
// vehicle the default needs 1.4 times the operations of the best one for the adjoint of index 1, 3 times for that of
// index 2.
constexpr std::int64_t kManyEntries = 30;
}  // namespace

struct KluSolver::Impl : KeptKluFactors<RealKlu> {
  using KeptKluFactors::KeptKluFactors;
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
  s.scale_by_columns(b, columns);
}

void KluSolver::solve_transposed(double* b, int columns) {
  Impl& s = *impl_;
  if (s.pattern->cols == 0) return;
  ++counters_.solves;
  s.scale_by_columns(b, columns);
  klu_l_tsolve(s.symbolic, s.numeric, s.pattern->cols, columns, b, &s.common);
}

double KluSolver::pivot_ratio() {
  Impl& s = *impl_;
  return s.numeric && RealKlu::condition(s.symbolic, s.numeric, &s.common) ? s.common.rcond : 0;
}

std::size_t KluSolver::saved_size() const { return impl_->saved_size(); }
void KluSolver::save(double* to) const { impl_->save(to); }

bool KluSolver::restore(long pivot_order, const double* from) {
  return impl_->pattern->cols == 0 || impl_->restore(order_, pivot_order, from);
}

void KluSolver::keep_pivot_orders(int at_most) { impl_->keep_orders(at_most); }

}  // namespace costate
