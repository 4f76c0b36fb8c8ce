// [force.NAME]: a force on a point with components in the ground frame; [couple.NAME]: a torque on one angle,
// or between two. Each is a number or a law of time.
#pragma once

#include <string>
#include <vector>

#include "costate/element/kind/law_options.h"

namespace costate {

void add_force(MechanismBuilder& builder, const std::string& name, const std::string& point,
               const LawOptions& x_N, const LawOptions& y_N);

/// Turns the (second) angle forward for a positive torque, the first of two backward.
void add_couple(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                const LawOptions& torque_N_m);

}  // namespace costate
