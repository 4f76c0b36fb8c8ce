// [cylindrical.NAME]: two axes coincide, along which the bodies slide and turn; [translational.NAME]: they
// slide only; [planar.NAME]: a point of the second body stays in a plane of the first, parallel to one of its
// own. With angle = "ROLL" and displacement = "REACH" the first two have coordinates ROLL.angle and
// REACH.displacement.
#pragma once

#include <string>
#include <utility>

#include "costate/kind/joint/joint_axes.h"

namespace costate {

void add_cylindrical(MechanismBuilder& builder, const std::string& name,
                     const std::pair<std::string, std::string>& points, const JointAxes& axes,
                     const JointCoordinates& coordinates = {});
void add_translational(MechanismBuilder& builder, const std::string& name,
                       const std::pair<std::string, std::string>& points, const JointAxes& axes,
                       const std::optional<JointCoordinate>& displacement = {});
/// The axes are the normals of the planes.
void add_planar(MechanismBuilder& builder, const std::string& name, const std::pair<std::string, std::string>& points,
                const JointAxes& normals);

}  // namespace costate
