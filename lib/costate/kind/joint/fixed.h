// [fixed.NAME]: a weld in space: two points coincide and the bodies do not turn against each other.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "costate/kind/joint/joint_axes.h"

namespace costate {

/// Without axes the bodies keep the orientation to each other that their start values (or first guesses)
/// have. With axes, these and the normals stay parallel, as in a translational joint.
void add_fixed(MechanismBuilder& builder, const std::string& name, const std::pair<std::string, std::string>& points,
               const std::optional<JointAxes>& axes = {});

}  // namespace costate
