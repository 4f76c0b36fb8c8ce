// What a user's cost or output says of itself, held against its own values before a run begins: a derivative that is
// wrong would be so in every formulation and method alike.
#pragma once

#include <memory>
#include <vector>

#include "costate/objective/objective.h"

namespace costate {

/// Whether a user's class decides its derivatives: its own, or its output's.
bool is_of_user(const CostTerm& term);

// Looked at, until they have passed once, are terms whose class, or whose output's class, is not of namespace costate,
// in three states, and such an output that ends the run (`end`, or null), each time: near the start, away from it, and
// on the other side of zero, at times up to 13 s.

/// Throws Error where a term changes with accelerations or multipliers though needs_accelerations() is false: they need
/// not be those of the motion then.
void check_cost_promises(const std::shared_ptr<const Mechanism>& mechanism, const ParameterSelection& parameters,
                         const Objective& objective, const std::vector<double>& rho,
                         const std::shared_ptr<const Output>& end = {});

/// Throws Error with the term, the derivative and both values where add_gradient(), change() or add_gradient_change()
/// is not the derivative of value(). Differences are extrapolated over falling steps, and tell nothing where no two of
/// these agree (1e-7). Allowed: 1e-5 of either derivative, and what rounding leaves.
void check_cost_derivatives(const std::shared_ptr<const Mechanism>& mechanism, const ParameterSelection& parameters,
                            const Objective& objective, const std::vector<double>& rho,
                            const std::shared_ptr<const Output>& end = {});

}  // namespace costate
