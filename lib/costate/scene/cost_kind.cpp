#include "costate/scene/cost_kind.h"

#include <algorithm>

#include "costate/base/error.h"
#include "costate/scene/sample_reader.h"

namespace costate {

namespace {
std::vector<CostKind>& cost_registry() {
  static std::vector<CostKind> kinds;
  return kinds;
}

MakeCostTerm read_term(SceneTable& table, MechanismBuilder& builder) {
  std::vector<std::string> names;
  for (const auto& k : cost_kinds()) names.push_back(k.name);
  const std::string name = table.one_of("kind", names);
  const auto kind =
      std::find_if(cost_kinds().begin(), cost_kinds().end(), [&](const auto& k) { return k.name == name; });
  // What a term misses in the mechanism is reported at the term, unless it says where itself.
  return [make = kind->read(table, builder), path = table.path()](const Mechanism& mechanism) {
    try {
      return make(mechanism);
    } catch (const ModelError& e) {
      throw ModelError(e.subject().empty() ? path : e.subject(), e.bare_message());
    }
  };
}
}  // namespace

const std::vector<CostKind>& cost_kinds() { return cost_registry(); }

RegisterCostKind::RegisterCostKind(CostKind kind) {
  auto& kinds = cost_registry();
  kinds.insert(std::upper_bound(kinds.begin(), kinds.end(), kind,
                                [](const CostKind& a, const CostKind& b) { return a.name < b.name; }),
               std::move(kind));
}

Objective CostPlan::make(const Mechanism& mechanism) const {
  Objective o;
  for (const auto& term : running) o.running.push_back(term(mechanism));
  for (const auto& term : terminal) o.terminal.push_back(term(mechanism));
  return o;
}

CostPlan read_cost(SceneTable& table, MechanismBuilder& builder) {
  CostPlan plan;
  for (SceneTable& t : table.tables("running")) plan.running.push_back(read_term(t, builder));
  for (SceneTable& t : table.tables("terminal")) plan.terminal.push_back(read_term(t, builder));
  for (SceneTable& t : table.tables("samples")) plan.terminal.push_back(read_samples(t, builder));
  return plan;
}

}  // namespace costate
