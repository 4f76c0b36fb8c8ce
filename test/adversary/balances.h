// Laws of mechanics that any stored motion of a truss obeys, by formulas of their own: energy changes by what forces,
// drivers and dampers give and take, each point's momentum by the forces on it, those of bars and drivers among them.
#pragma once

#include "judge.h"
#include "truss.h"

namespace costate::adversary {

/// Runs the truss at rtol 1e-8 and looks at what it stores.
std::vector<Finding> run_balances(const Truss& truss, const std::vector<std::pair<std::string, std::string>>& runs);
/// Of any scene: what energy.total grows by beyond the powers that elements report is made of nothing.
std::vector<Finding> run_created_energy(const std::string& scene,
                                        const std::vector<std::pair<std::string, std::string>>& runs);

}  // namespace costate::adversary
