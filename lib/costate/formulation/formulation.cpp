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
struct DiscreteForm {
  std::vector<FormulationOption> options;
  Formulation::MakeDiscrete make;
};
std::map<std::string, DiscreteForm>& waiting() {
  static std::map<std::string, DiscreteForm> forms;
  return forms;
}

void add(DiscreteForm form, Formulation& f) {
  f.options.insert(f.options.end(), form.options.begin(), form.options.end());
  f.make_discrete = std::move(form.make);
}
}  // namespace

RegisterDiscreteForm::RegisterDiscreteForm(const std::string& formulation, std::vector<FormulationOption> options,
                                           Formulation::MakeDiscrete make) {
  for (const auto& o : options) add_formulation_option(o);
  DiscreteForm form{std::move(options), std::move(make)};
  for (auto& f : table())
    if (f.name == formulation) {
      add(std::move(form), f);
      return;
    }
  waiting()[formulation] = std::move(form);
}

RegisterFormulation::RegisterFormulation(Formulation f) {
  for (const auto& o : f.options) add_formulation_option(o);
  if (auto form = waiting().extract(f.name)) add(std::move(form.mapped()), f);
  auto& t = table();
  for (const auto& other : t)
    if (other.name == f.name)
      throw Error(fmt::format("There is a formulation '{}' already: register yours by another name.", f.name));
  t.insert(std::upper_bound(t.begin(), t.end(), f, [](const auto& a, const auto& b) { return a.name < b.name; }),
           std::move(f));
}

const std::vector<Formulation>& formulations() { return table(); }

std::vector<const Formulation*> stand_ins(bool redundant) {
  std::vector<const Formulation*> r;
  for (const auto& f : table())
    if (f.stand_in > 0 && (f.carries_redundancy || !redundant)) r.push_back(&f);
  std::stable_sort(r.begin(), r.end(), [](const auto* a, const auto* b) { return a->stand_in < b->stand_in; });
  return r;
}

const Formulation& find_formulation(const std::string& name) {
  std::vector<std::string> names;
  for (const auto& f : table()) {
    if (f.name == name) return f;
    names.push_back(f.name);
  }
  throw CapabilityError(fmt::format("There is no formulation '{}'.{}", name, suggestion(name, names)));
}

}  // namespace costate
