// The weight alpha of penalty and augmented Lagrangian formulations, and the stabilization that it belongs to.
#pragma once

#include <memory>
#include <vector>

#include "costate/level/acceleration_level.h"
#include "costate/level/formulation_options.h"

namespace costate {

/// Of the weight, times the largest mass that a row moves.
inline constexpr double kPenaltyStiffness = 2e8;
/// lib/README.md (4.5), at the scene's own numbers and first positions, so that it varies neither along the motion nor
/// with the parameters, and follows the units and sizes of the scene.
double default_penalty_weight(const std::shared_ptr<const Mechanism>& mechanism);

/// penalty_xi, penalty_omega_rad_per_s and penalty_alpha.
const std::vector<FormulationOption>& penalty_options();

/// alpha of the options, by default as above.
double penalty_weight(const std::shared_ptr<const Mechanism>& mechanism, const FormulationOptions& o);

/// xi, omega and 1/alpha of the options, alpha by default as above.
Stabilization penalty_stabilization(const std::shared_ptr<const Mechanism>& mechanism, const FormulationOptions& o);

/// With which constraints are exact and may depend on each other.
Stabilization augmented_stabilization(const std::shared_ptr<const Mechanism>& mechanism);

/// The same options with ten times the weight.
FormulationOptions firmer_penalty(const std::shared_ptr<const Mechanism>& mechanism, const FormulationOptions& o);
/// Whether the weight is the user's.
bool penalty_weight_chosen(const FormulationOptions& o);

}  // namespace costate
