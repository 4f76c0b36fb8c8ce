// The registry of cost terms in scenes: [[cost.running]] and [[cost.terminal]] with kind = "...". A user's
// own cost is one file with a CostTerm and its registration.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "costate/objective/objective.h"
#include "costate/scene/scene_table.h"

namespace costate {

/// A term is read while numbers can still be added, and made when the mechanism exists.
using MakeCostTerm = std::function<std::shared_ptr<const CostTerm>(const Mechanism& mechanism)>;

struct CostKind {
  std::string name;
  std::string summary = {};
  std::function<MakeCostTerm(SceneTable& table, MechanismBuilder& builder)> read;
};

/// All registered kinds by name.
const std::vector<CostKind>& cost_kinds();
struct RegisterCostKind {
  explicit RegisterCostKind(CostKind kind);
};

/// The terms of a cost that has been read.
struct CostPlan {
  std::vector<MakeCostTerm> running, terminal;
  Objective make(const Mechanism& mechanism) const;
};
/// Reads the arrays of tables 'running', 'terminal' and 'samples' (sample_reader.h) of a table.
CostPlan read_cost(SceneTable& table, MechanismBuilder& builder);

}  // namespace costate
