#include "costate/level/kkt_groups.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "costate/linear/kkt_solver.h"

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
}  // namespace

std::vector<int> kkt_groups(const Assembly& assembly, const SparsePattern& kkt) {
  const int n = assembly.n(), m = assembly.m();
  if (n + m <= kLargestGroup) {
    std::vector<int> one(static_cast<std::size_t>(n + m), 0);
    return density(kkt, one) < kLeastDensity ? std::vector<int>{} : one;
  }
  // Coordinates that masses link.
  std::vector<int> root(static_cast<std::size_t>(n));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int i) {
    while (root[static_cast<std::size_t>(i)] != i)
      i = root[static_cast<std::size_t>(i)] = root[static_cast<std::size_t>(root[static_cast<std::size_t>(i)])];
    return i;
  };
  std::vector<bool> moves(static_cast<std::size_t>(n), false);
  for (const auto& body : assembly.mechanism().bodies()) {
    const auto& c = body->coordinates();
    for (const int i : c) {
      moves[static_cast<std::size_t>(i)] = true;
      root[static_cast<std::size_t>(find(i))] = find(c.front());
    }
  }
  std::vector<int> group(static_cast<std::size_t>(n + m), -1), size;
  for (int i = 0; i < n; ++i) {
    if (!moves[static_cast<std::size_t>(i)]) continue;  // without masses: on the border
    int& g = group[static_cast<std::size_t>(find(i))];
    if (g < 0) {
      g = static_cast<int>(size.size());
      size.push_back(0);
    }
    group[static_cast<std::size_t>(i)] = g;
    if (++size[static_cast<std::size_t>(g)] > kLargestGroup) return {};
  }
  // Rows of one group join it, those of the fewest coordinates first: without the lengths of Euler parameters a body's
  // masses are singular.
  std::vector<std::vector<int>> columns(static_cast<std::size_t>(m));
  const SparsePattern& jacobian = assembly.jacobian();
  for (int j = 0; j < n; ++j)
    for (auto k = jacobian.column_start[static_cast<std::size_t>(j)];
         k < jacobian.column_start[static_cast<std::size_t>(j) + 1]; ++k)
      columns[static_cast<std::size_t>(jacobian.row[static_cast<std::size_t>(k)])].push_back(j);
  std::vector<int> rows(static_cast<std::size_t>(m));
  std::iota(rows.begin(), rows.end(), 0);
  std::stable_sort(rows.begin(), rows.end(), [&](int a, int b) {
    return columns[static_cast<std::size_t>(a)].size() < columns[static_cast<std::size_t>(b)].size();
  });
  std::vector<std::size_t> meet(size.size(), 0);
  for (const int r : rows) {
    std::vector<int> in;
    for (const int j : columns[static_cast<std::size_t>(r)]) in.push_back(group[static_cast<std::size_t>(j)]);
    std::sort(in.begin(), in.end());
    in.erase(std::unique(in.begin(), in.end()), in.end());
    if (in.size() == 1 && in[0] >= 0 && size[static_cast<std::size_t>(in[0])] < kLargestGroup) {
      group[static_cast<std::size_t>(n + r)] = in[0];
      ++size[static_cast<std::size_t>(in[0])];
    } else {
      for (const int g : in)
        if (g >= 0 && ++meet[static_cast<std::size_t>(g)] > kMostRows) return {};
    }
  }
  // Rows that others name by their normal force go with them.
  for (bool moved = true; std::exchange(moved, false);)
    for (int j = n; j < n + m; ++j)
      for (auto k = kkt.column_start[static_cast<std::size_t>(j)];
           k < kkt.column_start[static_cast<std::size_t>(j) + 1]; ++k) {
        const auto i = static_cast<std::size_t>(kkt.row[static_cast<std::size_t>(k)]),
                   col = static_cast<std::size_t>(j);
        if (static_cast<int>(i) < n || group[i] == group[col] || group[i] < 0 || group[col] < 0) continue;
        group[i] = group[col] = -1;
        moved = true;
      }
  return density(kkt, group) < kLeastDensity ? std::vector<int>{} : group;
}

}  // namespace costate
