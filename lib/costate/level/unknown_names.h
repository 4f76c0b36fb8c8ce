// Names, units and roles of a system's unknowns, from the mechanism's tables.
#pragma once

#include <vector>

#include "costate/level/unknown.h"
#include "costate/mechanism/mechanism.h"

namespace costate {

/// (q, v, z).
void append_differential_unknowns(const Mechanism& mechanism, std::vector<Unknown>& unknowns);
/// (a, lambda); `in_norm` as in Unknown.
void append_algebraic_unknowns(const Mechanism& mechanism, std::vector<Unknown>& unknowns, bool in_norm);

}  // namespace costate
