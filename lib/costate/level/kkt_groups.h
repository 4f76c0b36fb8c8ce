// How the unknowns of a KKT matrix [[M, Phi_q^T], [Phi_q, .]] fall into groups that only its border links
// (linear/bordered_solver.h): bodies with the rows that are of one of them alone, and the rows between bodies.
#pragma once

#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

/// The group of each of the n + m unknowns, or -1 on the border; none where groups would be large or many rows meet in
/// one, so that a sparse solver is better. `kkt`: the pattern; its entries in the square of the n coordinates count
/// where a body has masses.
std::vector<int> kkt_groups(const Assembly& assembly, const SparsePattern& kkt);

}  // namespace costate
