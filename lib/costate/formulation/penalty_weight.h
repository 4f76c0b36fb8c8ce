// The weight alpha of penalty and augmented Lagrangian formulations, and the stabilization that it belongs to.
#pragma once

#include <memory>

#include "costate/formulation/acceleration_level.h"
#include "costate/formulation/formulation.h"

namespace costate {

/// 1e8 times the largest entry of the mass matrix at the scene's own numbers, so that it does not vary with the
/// parameters.
double default_penalty_weight(const std::shared_ptr<const Mechanism>& mechanism);

/// xi, omega and 1/alpha of the options, alpha by default as above.
Stabilization penalty_stabilization(const std::shared_ptr<const Mechanism>& mechanism, const FormulationOptions& o);

}  // namespace costate
