#include "costate/linear/kkt_solver.h"

#include <algorithm>
#include <map>
#include <utility>

namespace costate {

namespace {

// So many factorizations by groups in a row whose pivots were too small, and no other one is tried.
constexpr int kPatience = 4;
constexpr std::size_t kMostGroupings = 4;

/// Of an unknown on the border the groups that it links, each once.
std::vector<int> linked(const SparsePattern& pattern, const std::vector<int>& group, std::size_t unknown) {
  std::vector<int> groups;
  for (auto k = pattern.column_start[unknown]; k < pattern.column_start[unknown + 1]; ++k)
    if (const int g = group[static_cast<std::size_t>(pattern.row[static_cast<std::size_t>(k)])]; g >= 0)
      groups.push_back(g);
  std::sort(groups.begin(), groups.end());
  groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
  return groups;
}

/// Each of the weak groups becomes one with the neighbour to which most unknowns of the border link it, of several with
/// the one that has the fewest of them, as long as groups stay small; what links no others joins them. False where one
/// finds none.
bool merge(const SparsePattern& pattern, std::vector<int>& group, const std::vector<int>& weak) {
  const std::vector<int> before(group);
  for (const int w : weak) {
    if (std::find(group.begin(), group.end(), w) == group.end()) continue;
    const auto links_of = [&](int g) {
      int links = 0;
      for (std::size_t i = 0; i < group.size(); ++i) {
        if (group[i] >= 0) continue;
        const std::vector<int> all = linked(pattern, group, i);
        links += std::find(all.begin(), all.end(), g) != all.end() ? 1 : 0;
      }
      return links;
    };
    std::map<int, std::pair<int, int>> neighbours;  // unknowns of the border in common, and those of no others
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (group[i] >= 0) continue;
      const std::vector<int> links = linked(pattern, group, i);
      if (std::find(links.begin(), links.end(), w) == links.end()) continue;
      for (const int g : links)
        if (g != w) {
          ++neighbours[g].first;
          neighbours[g].second += links.size() == 2 ? 1 : 0;
        }
    }
    const auto size = [&](int g) { return static_cast<int>(std::count(group.begin(), group.end(), g)); };
    int best = -1, most = 0, fewest = 0;
    for (const auto& [g, in_common] : neighbours) {
      if (in_common.second == 0 || size(w) + size(g) + in_common.second > KktSolver::kLargestGroup) continue;
      if (in_common.second < most || (in_common.second == most && links_of(g) >= fewest)) continue;
      best = g;
      most = in_common.second;
      fewest = links_of(g);
    }
    if (best < 0) return false;
    std::replace(group.begin(), group.end(), w, best);
    for (std::size_t i = 0; i < group.size(); ++i)
      if (group[i] < 0 && linked(pattern, group, i) == std::vector<int>{best}) group[i] = best;
  }
  // Numbers without gaps.
  std::map<int, int> number;
  for (int& g : group)
    if (g >= 0) g = number.emplace(g, static_cast<int>(number.size())).first->second;
  return group != before;
}

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
    std::vector<int> group = groupings_[at_].group;
    if (!merge(pattern_, group, weak) || !add(std::move(group))) return false;
    groupings_[at_].weak = weak;
  }
  ++at_;
  return true;
}

int KktSolver::factor(const double* values) {
  ++factorizations_;
  by_groups_ = false;
  if (!groupings_.empty() && refused_ < kPatience) do
      by_groups_ = grouped().factor(values);
    while (!by_groups_ && merge_weak());
  if (by_groups_) {
    refused_ = 0;
    return -1;
  }
  ++refused_;
  return sparse().factor(values);
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
