#include "costate/linear/complex_klu_solver.h"

#include "costate/linear/kept_klu_factors.h"

namespace costate {

namespace {
// From so many unknowns on the ordering is chosen by the first numbers.
constexpr int kManyUnknowns = 60;

double* numbers(const std::complex<double>* values) {
  return const_cast<double*>(reinterpret_cast<const double*>(values));
}
}  // namespace

struct ComplexKluSolver::Impl : KeptKluFactors<ComplexKlu> {
  using KeptKluFactors::KeptKluFactors;
};

ComplexKluSolver::ComplexKluSolver(const SparsePattern& pattern)
    : impl_(std::make_unique<Impl>(pattern, pattern.cols >= kManyUnknowns)) {}

ComplexKluSolver::~ComplexKluSolver() = default;
ComplexKluSolver::ComplexKluSolver(ComplexKluSolver&&) noexcept = default;

int ComplexKluSolver::factor(const std::complex<double>* values) {
  Impl& s = *impl_;
  if (s.pattern->cols == 0) return -1;
  ++factorizations_;
  s.choose_ordering(numbers(values));
  if (s.refactor(numbers(values))) return -1;
  s.retire(order_);
  order_ = ++orders_;
  return s.factor(numbers(values));
}

void ComplexKluSolver::solve(std::complex<double>* b) {
  Impl& s = *impl_;
  if (s.pattern->cols == 0) return;
  klu_zl_solve(s.symbolic, s.numeric, s.pattern->cols, 1, numbers(b), &s.common);
  s.scale_by_columns(numbers(b));
}

void ComplexKluSolver::solve_transposed(std::complex<double>* b) {
  Impl& s = *impl_;
  if (s.pattern->cols == 0) return;
  s.scale_by_columns(numbers(b));
  klu_zl_tsolve(s.symbolic, s.numeric, s.pattern->cols, 1, numbers(b), 0, &s.common);
}

std::size_t ComplexKluSolver::saved_size() const { return impl_->saved_size(); }
void ComplexKluSolver::save(double* to) const { impl_->save(to); }

bool ComplexKluSolver::restore(long pivot_order, const double* from) {
  return impl_->pattern->cols == 0 || impl_->restore(order_, pivot_order, from);
}

void ComplexKluSolver::keep_pivot_orders(int at_most) { impl_->keep_orders(at_most); }

}  // namespace costate
