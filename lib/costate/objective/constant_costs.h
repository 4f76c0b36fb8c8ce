// Costs on named outputs with constant coefficients, for mechanisms that are built in C++. (The costs of a scene have
// their coefficients among the mechanism's numbers, so that these can be parameters, too: OutputTerm.)
#pragma once

#include <memory>
#include <string>

#include "costate/objective/objective.h"

namespace costate {

/// weight (output - target)^2. Throws ModelError with near names when the mechanism has no such output; the term must
/// not outlive the mechanism.
std::shared_ptr<const CostTerm> square_cost(const Mechanism& mechanism, const std::string& output, double target = 0,
                                            double weight = 1);

/// weight output.
std::shared_ptr<const CostTerm> value_cost(const Mechanism& mechanism, const std::string& output, double weight = 1);

}  // namespace costate
