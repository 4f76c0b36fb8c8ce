#include "costate/mechanism/coordinate_parts.h"

#include <numeric>

namespace costate {

std::vector<int> coordinate_parts(const Mechanism& mechanism) {
  std::vector<int> root(static_cast<std::size_t>(mechanism.coordinate_count()));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int i) {
    while (root[static_cast<std::size_t>(i)] != i)
      i = root[static_cast<std::size_t>(i)] = root[static_cast<std::size_t>(root[static_cast<std::size_t>(i)])];
    return i;
  };
  const auto join = [&](const auto& elements) {
    for (const auto& e : elements)
      for (const int i : e->coordinates()) root[static_cast<std::size_t>(find(i))] = find(e->coordinates().front());
  };
  join(mechanism.bodies());
  join(mechanism.constraints());
  join(mechanism.forces());
  for (std::size_t i = 0; i < root.size(); ++i) root[i] = find(static_cast<int>(i));
  return root;
}

}  // namespace costate
