#include "costate/mechanism/coordinate_parts.h"

#include <numeric>

namespace costate {

namespace {

/// Coordinates that elements link, as a forest.
class Links {
 public:
  explicit Links(int coordinates) : root_(static_cast<std::size_t>(coordinates)) {
    std::iota(root_.begin(), root_.end(), 0);
  }
  template <class Elements>
  void join(const Elements& elements) {
    for (const auto& e : elements)
      for (const int i : e->coordinates()) root_[static_cast<std::size_t>(find(i))] = find(e->coordinates().front());
  }
  std::vector<int> parts() {
    for (std::size_t i = 0; i < root_.size(); ++i) root_[i] = find(static_cast<int>(i));
    return root_;
  }

 private:
  int find(int i) {
    while (root_[static_cast<std::size_t>(i)] != i)
      i = root_[static_cast<std::size_t>(i)] = root_[static_cast<std::size_t>(root_[static_cast<std::size_t>(i)])];
    return i;
  }

  std::vector<int> root_;
};

}  // namespace

std::vector<int> coordinate_parts(const Mechanism& mechanism) {
  Links links(mechanism.coordinate_count());
  links.join(mechanism.bodies());
  links.join(mechanism.constraints());
  links.join(mechanism.forces());
  return links.parts();
}

std::vector<int> constrained_parts(const Mechanism& mechanism) {
  Links links(mechanism.coordinate_count());
  links.join(mechanism.bodies());
  links.join(mechanism.constraints());
  return links.parts();
}

std::vector<int> body_parts(const Mechanism& mechanism) {
  Links links(mechanism.coordinate_count());
  links.join(mechanism.bodies());
  return links.parts();
}

}  // namespace costate
