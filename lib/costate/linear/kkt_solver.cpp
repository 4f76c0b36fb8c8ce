#include "costate/linear/kkt_solver.h"

namespace costate {

namespace {
// So many factorizations by groups in a row whose pivots were too small, and no other one is tried.
constexpr int kPatience = 4;
}  // namespace

KktSolver::KktSolver(const SparsePattern& pattern, const std::vector<int>& group) : pattern_(pattern) {
  if (!group.empty()) grouped_ = std::make_unique<BorderedSolver>(pattern, group);
}

KluSolver& KktSolver::sparse() {
  if (!sparse_) {
    sparse_ = std::make_unique<KluSolver>(pattern_);
    sparse_->keep_pivot_orders(kept_orders_);
  }
  return *sparse_;
}

int KktSolver::factor(const double* values) {
  ++factorizations_;
  by_groups_ = grouped_ && refused_ < kPatience && grouped_->factor(values);
  if (by_groups_) {
    refused_ = 0;
    return -1;
  }
  ++refused_;
  return sparse().factor(values);
}

void KktSolver::forget_pivots() {
  refused_ = 0;
  if (grouped_) grouped_->forget_scale();
  if (sparse_) sparse_->forget_pivots();
}

bool KktSolver::restore(long pivot_order, const double* from) {
  const bool grouped = pivot_order < 0;
  if (grouped ? !grouped_ || !grouped_->restore(-pivot_order, from) : !sparse().restore(pivot_order, from))
    return false;
  by_groups_ = grouped;
  return true;
}

void KktSolver::keep_pivot_orders(int at_most) {
  kept_orders_ = at_most;
  if (grouped_) grouped_->keep_pivot_orders(at_most);
  if (sparse_) sparse_->keep_pivot_orders(at_most);
}

}  // namespace costate
