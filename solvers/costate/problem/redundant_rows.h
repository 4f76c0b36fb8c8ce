// Constraint rows that depend on each other at the start: which formulations can treat a problem depends on them, and
// what is known of its reactions.
#pragma once

#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

/// "2 of 9 constraint rows depend on the others (...)." at the start for rho, or empty. Throws as find_start does.
std::string redundant_rows(const Problem& problem, const std::vector<double>& rho);

/// Gives notice of what a run hands out of reactions that the motion does not determine: these outputs, and all
/// multipliers or none.
void tell_of_open_reactions(const Problem& problem, const std::vector<double>& rho,
                            const std::vector<std::unique_ptr<Output>>& outputs, bool multipliers);

/// Names of all outputs but those of reactions that the motion does not determine; of more than `most` none.
std::vector<std::string> determined_outputs(const Problem& problem, const std::vector<double>& rho, std::size_t most);

}  // namespace costate
