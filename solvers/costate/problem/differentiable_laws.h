// What has to hold of a problem's laws before derivatives are taken through a run: at every method's door.
#pragma once

#include <vector>

#include "costate/problem/problem.h"

namespace costate {

/// Throws CapabilityError where parameters move times of laws that are not carried across, and where laws jump
/// (level/fixed_times.h, formulation/law_joins.h). `carried`: whether the method carries such times.
void require_differentiable_laws(const Problem& problem, const std::vector<double>& rho, bool carried);
/// The same of second derivatives, which carry times that parameters move evenly.
void require_twice_differentiable_laws(const Problem& problem, const std::vector<double>& rho);

}  // namespace costate
