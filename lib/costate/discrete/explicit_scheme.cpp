#include "costate/discrete/explicit_scheme.h"

#include <algorithm>

namespace costate {

namespace {
std::vector<ExplicitScheme>& table() {
  static std::vector<ExplicitScheme> schemes;
  return schemes;
}
}  // namespace

RegisterExplicitScheme::RegisterExplicitScheme(ExplicitScheme scheme) {
  auto& t = table();
  t.insert(std::upper_bound(t.begin(), t.end(), scheme, [](const auto& x, const auto& y) { return x.order < y.order; }),
           std::move(scheme));
}

const std::vector<ExplicitScheme>& explicit_schemes() { return table(); }

const ExplicitScheme* find_explicit_scheme(const std::string& name) {
  const auto found = std::find_if(table().begin(), table().end(), [&](const auto& s) { return s.name == name; });
  return found == table().end() ? nullptr : &*found;
}

}  // namespace costate
