// Rates along the motion of the rows with which multipliers act. What slides has a row along the ground among them
// (Assembly::reaction_jacobian), of which the partial derivatives hold nothing: they are those of the contact as if it
// stuck.
#pragma once

#include "costate/assembly/assembly.h"

namespace costate {

/// phid_q and phidd_q at s, after calc_partials() there, with those rows. Returns whether anything slides: the assembly
/// is then to be evaluated again.
bool calc_reaction_rates(Assembly& assembly, const StateView& s, std::vector<double>& phid_q,
                         std::vector<double>& phidd_q);

}  // namespace costate
