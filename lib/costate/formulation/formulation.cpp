#include "costate/formulation/formulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "costate/base/error.h"

namespace costate {

namespace {
std::vector<Formulation>& table() {
  static std::vector<Formulation> formulations;
  return formulations;
}
// Static objects register in any order: those fixed steps whose formulation is not known yet wait here.
std::map<std::string, Formulation::MakeDiscrete>& waiting() {
  static std::map<std::string, Formulation::MakeDiscrete> forms;
  return forms;
}
}  // namespace

RegisterDiscreteForm::RegisterDiscreteForm(const std::string& formulation, Formulation::MakeDiscrete make) {
  for (auto& f : table())
    if (f.name == formulation) {
      f.make_discrete = std::move(make);
      return;
    }
  waiting()[formulation] = std::move(make);
}

RegisterFormulation::RegisterFormulation(Formulation f) {
  if (auto form = waiting().extract(f.name)) f.make_discrete = std::move(form.mapped());
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
