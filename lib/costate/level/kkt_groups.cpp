#include "costate/level/kkt_groups.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "costate/linear/kkt_solver.h"
#include "costate/mechanism/coordinate_parts.h"

namespace costate {

namespace {
constexpr int kLargestGroup = KktSolver::kLargestGroup;
// Rows of the border that meet in a group fill each other's.
constexpr std::size_t kMostRows = 48;
// Blocks of which less than this part are entries of the matrix are better sparse.
constexpr double kLeastDensity = 0.3;

/// Of the blocks of the groups, and of those between them and the border.
double density(const SparsePattern& kkt, const std::vector<int>& group) {
  std::map<int, std::set<int>> border;
  std::map<int, double> size;
  for (const int g : group)
    if (g >= 0) ++size[g];
  double entries = 0, places = 0;
  for (std::size_t j = 0; j < group.size(); ++j)
    for (auto k = kkt.column_start[j]; k < kkt.column_start[j + 1]; ++k) {
      const auto i = static_cast<std::size_t>(kkt.row[static_cast<std::size_t>(k)]);
      if (group[i] < 0 || (group[j] >= 0 && group[i] != group[j])) continue;
      ++entries;
      if (group[j] < 0) border[group[i]].insert(static_cast<int>(j));
    }
  for (const auto& [g, n] : size) places += n * (n + static_cast<double>(border[g].size()));
  return places > 0 ? entries / places : 0;
}
/// Of each row the coordinates that it moves.
std::vector<std::vector<int>> coordinates_of_rows(const Assembly& assembly) {
  std::vector<std::vector<int>> coordinates(static_cast<std::size_t>(assembly.m()));
  const SparsePattern& jacobian = assembly.jacobian();
  for (std::size_t j = 0; j < static_cast<std::size_t>(assembly.n()); ++j)
    for (auto k = jacobian.column_start[j]; k < jacobian.column_start[j + 1]; ++k)
      coordinates[static_cast<std::size_t>(jacobian.row[static_cast<std::size_t>(k)])].push_back(static_cast<int>(j));
  return coordinates;
}

/// group[n + r] of the rows; false where too many meet in one group on the border.
bool join_rows(const Assembly& assembly, std::vector<int>& group, std::vector<int>& size) {
  const auto n = static_cast<std::size_t>(assembly.n());
  const std::vector<std::vector<int>> coordinates = coordinates_of_rows(assembly);
  // Those of the fewest coordinates first: without the lengths of Euler parameters a body's masses are singular.
  std::vector<std::size_t> rows(coordinates.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  std::stable_sort(rows.begin(), rows.end(),
                   [&](std::size_t a, std::size_t b) { return coordinates[a].size() < coordinates[b].size(); });
  std::vector<std::size_t> meet(size.size(), 0);
  for (const std::size_t r : rows) {
    std::set<int> in;
    for (const int j : coordinates[r]) in.insert(group[static_cast<std::size_t>(j)]);
    const int first = in.empty() ? -1 : *in.begin();
    if (in.size() == 1 && first >= 0 && size[static_cast<std::size_t>(first)] < kLargestGroup) {
      group[n + r] = first;
      ++size[static_cast<std::size_t>(first)];
      continue;
    }
    for (const int g : in)
      if (g >= 0 && ++meet[static_cast<std::size_t>(g)] > kMostRows) return false;
  }
  return true;
}

/// Rows that others name by their normal force go to the border with them.
void keep_linked_rows_together(const SparsePattern& kkt, std::size_t n, std::vector<int>& group) {
  for (bool moved = true; std::exchange(moved, false);)
    for (std::size_t j = n; j < group.size(); ++j)
      for (auto k = kkt.column_start[j]; k < kkt.column_start[j + 1]; ++k) {
        const auto i = static_cast<std::size_t>(kkt.row[static_cast<std::size_t>(k)]);
        if (i < n || group[i] == group[j] || group[i] < 0 || group[j] < 0) continue;
        group[i] = group[j] = -1;
        moved = true;
      }
}

}  // namespace

std::vector<int> kkt_groups(const Assembly& assembly, const SparsePattern& kkt) {
  const auto n = static_cast<std::size_t>(assembly.n()), all = n + static_cast<std::size_t>(assembly.m());
  std::vector<int> group(all, all <= kLargestGroup ? 0 : -1);
  if (all > kLargestGroup) {
    const std::vector<int> part = body_parts(assembly.mechanism());
    std::vector<bool> moves(n, false);  // what has no mass is on the border
    for (const auto& body : assembly.mechanism().bodies())
      for (const int i : body->coordinates()) moves[static_cast<std::size_t>(i)] = true;
    std::map<int, int> number;
    std::vector<int> size;
    for (std::size_t i = 0; i < n; ++i) {
      if (!moves[i]) continue;
      group[i] = number.emplace(part[i], static_cast<int>(number.size())).first->second;
      size.resize(number.size());
      if (++size[static_cast<std::size_t>(group[i])] > kLargestGroup) return {};
    }
    if (!join_rows(assembly, group, size)) return {};
    keep_linked_rows_together(kkt, n, group);
  }
  return density(kkt, group) < kLeastDensity ? std::vector<int>{} : group;
}

}  // namespace costate
