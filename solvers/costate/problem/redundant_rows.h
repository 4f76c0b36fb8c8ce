// Constraint rows that depend on each other at the start: which formulations can treat a problem depends on them.
#pragma once

#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

/// "2 of 9 constraint rows depend on the others (...)." at the start for rho, or empty. Throws as find_start does.
std::string redundant_rows(const Problem& problem, const std::vector<double>& rho);

}  // namespace costate
