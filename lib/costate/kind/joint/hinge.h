// [hinge.NAME]: a revolute joint in space, two points and two axes coincide; [universal.NAME]: two points
// coincide and two axes stay perpendicular. A hinge with angle = "ELBOW" has a coordinate ELBOW.angle.
#pragma once

#include <string>
#include <utility>

#include "costate/kind/joint/joint_axes.h"

namespace costate {

void add_hinge(MechanismBuilder& builder, const std::string& name, const std::pair<std::string, std::string>& points,
               const JointAxes& axes, const std::optional<JointCoordinate>& angle = {});
void add_universal(MechanismBuilder& builder, const std::string& name,
                   const std::pair<std::string, std::string>& points, const JointAxes& axes);

}  // namespace costate
