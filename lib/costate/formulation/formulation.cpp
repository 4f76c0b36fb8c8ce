#include "costate/formulation/formulation.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"

namespace costate {

namespace {
std::vector<Formulation>& table() {
  static std::vector<Formulation> formulations;
  return formulations;
}
}  // namespace

RegisterFormulation::RegisterFormulation(Formulation f) {
  auto& t = table();
  t.insert(std::upper_bound(t.begin(), t.end(), f, [](const auto& a, const auto& b) { return a.name < b.name; }),
           std::move(f));
}

const std::vector<Formulation>& formulations() { return table(); }

const Formulation& find_formulation(const std::string& name) {
  std::vector<std::string> names;
  for (const auto& f : table()) {
    if (f.name == name) return f;
    names.push_back(f.name);
  }
  throw CapabilityError(fmt::format("There is no formulation '{}'.{}", name, suggestion(name, names)));
}

}  // namespace costate
