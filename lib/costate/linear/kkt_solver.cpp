#include "costate/linear/kkt_solver.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace costate {

namespace {

// So many factorizations by groups in a row whose pivots were too small, and no other one is tried.
constexpr int kPatience = 4;
constexpr std::size_t kMostGroupings = 4;

/// Groups, the unknowns that they have and those of the border that link them, as they are merged.
class Merging {
 public:
  Merging(const SparsePattern& pattern, const std::vector<int>& group) : group_(group), links_(group.size()) {
    const int count = group.empty() ? 0 : *std::max_element(group.begin(), group.end()) + 1;
    unknowns_.resize(static_cast<std::size_t>(count));
    border_.resize(unknowns_.size());
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (group[i] >= 0) {
        unknowns_[static_cast<std::size_t>(group[i])].push_back(i);
        continue;
      }
      for (auto k = pattern.column_start[i]; k < pattern.column_start[i + 1]; ++k)
        if (const int g = group[static_cast<std::size_t>(pattern.row[static_cast<std::size_t>(k)])]; g >= 0)
          links_[i].insert(g);
      for (const int g : links_[i]) border_[static_cast<std::size_t>(g)].insert(i);
    }
  }

  /// The weak group becomes one with the neighbour to which most unknowns of the border link it alone, of several with
  /// the one that has the fewest others, as long as they are small together; what links no others joins them. False
  /// where there is none.
  bool merge(int weak) {
    if (unknowns_[static_cast<std::size_t>(weak)].empty()) return true;  // it has become part of another weak one
    std::map<int, int> shared;  // of each neighbour, unknowns of the border that link no others
    for (const std::size_t i : border_of(weak))
      if (links_[i].size() == 2) ++shared[*links_[i].begin() == weak ? *links_[i].rbegin() : *links_[i].begin()];
    int best = -1;
    const auto size = [&](int g) { return static_cast<int>(unknowns_[static_cast<std::size_t>(g)].size()); };
    for (const auto& [g, count] : shared) {
      if (size(weak) + size(g) + count > KktSolver::kLargestGroup) continue;
      if (best < 0 || count > shared[best] || (count == shared[best] && border_of(g).size() < border_of(best).size()))
        best = g;
    }
    if (best < 0) return false;
    auto& own = unknowns_[static_cast<std::size_t>(best)];
    const std::set<std::size_t> border = std::exchange(border_of(weak), {});
    for (const std::size_t i : std::exchange(unknowns_[static_cast<std::size_t>(weak)], {})) own.push_back(i);
    for (const std::size_t i : border) {
      links_[i].erase(weak);
      links_[i].insert(best);
      border_of(best).insert(i);
      if (links_[i].size() > 1) continue;
      border_of(best).erase(i);
      own.push_back(i);
    }
    return true;
  }

  /// The groups as they are now, with numbers without gaps.
  std::vector<int> groups() const {
    std::vector<int> group(group_.size(), -1);
    int number = 0;
    for (const auto& unknowns : unknowns_) {
      if (unknowns.empty()) continue;
      for (const std::size_t i : unknowns) group[i] = number;
      ++number;
    }
    return group;
  }

 private:
  std::set<std::size_t>& border_of(int g) { return border_[static_cast<std::size_t>(g)]; }

  const std::vector<int>& group_;
  std::vector<std::set<int>> links_;                // of unknowns on the border
  std::vector<std::vector<std::size_t>> unknowns_;  // of groups
  std::vector<std::set<std::size_t>> border_;
};

}  // namespace

KktSolver::KktSolver(const SparsePattern& pattern, std::vector<int> group) : pattern_(pattern) {
  if (!group.empty()) add(std::move(group));
}

bool KktSolver::add(std::vector<int> group) {
  if (groupings_.size() == kMostGroupings) return false;
  auto solver = std::make_unique<BorderedSolver>(pattern_, group);
  solver->keep_pivot_orders(kept_orders_);
  groupings_.push_back({std::move(group), std::move(solver)});
  return true;
}

KluSolver& KktSolver::sparse() {
  if (!sparse_) {
    sparse_ = std::make_unique<KluSolver>(pattern_);
    sparse_->keep_pivot_orders(kept_orders_);
  }
  return *sparse_;
}

bool KktSolver::merge_weak() {
  const std::vector<int> weak = grouped().weak_groups();
  if (weak.empty()) return false;
  // What has been made before serves if it merges the same ones.
  if (at_ + 1 < groupings_.size() && groupings_[at_].weak != weak)
    groupings_.erase(groupings_.begin() + static_cast<std::ptrdiff_t>(at_) + 1, groupings_.end());
  if (at_ + 1 == groupings_.size()) {
    Merging merging(pattern_, groupings_[at_].group);
    for (const int w : weak)
      if (!merging.merge(w)) return false;
    if (!add(merging.groups())) return false;
    groupings_[at_].weak = weak;
  }
  ++at_;
  return true;
}

int KktSolver::factor(const double* values) {
  ++factorizations_;
  by_groups_ = false;
  if (!groupings_.empty() && refused_ < kPatience) {
    by_groups_ = grouped().factor(values);
    while (!by_groups_ && merge_weak()) by_groups_ = grouped().factor(values);
  }
  refused_ = by_groups_ ? 0 : refused_ + 1;
  return by_groups_ ? -1 : sparse().factor(values);
}

void KktSolver::forget_pivots() {
  refused_ = 0;
  at_ = 0;
  for (Grouping& g : groupings_) g.solver->forget_scale();
  if (sparse_) sparse_->forget_pivots();
}

std::size_t KktSolver::saved_size() const {
  return by_groups_ ? grouped().saved_size() : sparse_ ? sparse_->saved_size() : 0;
}

// Negative by groups: of the grouping, and of its scaling.
long KktSolver::pivot_order() const {
  if (by_groups_) return -(grouped().scaling() * static_cast<long>(kMostGroupings) + static_cast<long>(at_));
  return sparse_ ? sparse_->pivot_order() : 0;
}

void KktSolver::save(double* to) const {
  if (by_groups_)
    grouped().save(to);
  else if (sparse_)
    sparse_->save(to);
}

bool KktSolver::restore(long pivot_order, const double* from) {
  if (pivot_order >= 0) {
    if (!sparse().restore(pivot_order, from)) return false;
    by_groups_ = false;
    return true;
  }
  const auto at = static_cast<std::size_t>(-pivot_order) % kMostGroupings;
  if (at >= groupings_.size() ||
      !groupings_[at].solver->restore(-pivot_order / static_cast<long>(kMostGroupings), from))
    return false;
  at_ = at;
  by_groups_ = true;
  return true;
}

void KktSolver::keep_pivot_orders(int at_most) {
  kept_orders_ = at_most;
  for (Grouping& g : groupings_) g.solver->keep_pivot_orders(at_most);
  if (sparse_) sparse_->keep_pivot_orders(at_most);
}

}  // namespace costate
