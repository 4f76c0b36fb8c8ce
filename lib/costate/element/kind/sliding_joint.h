// [cylindrical.NAME]: two axes coincide, along which the bodies slide and turn; [translational.NAME]: they
// slide only.
#pragma once

#include <string>
#include <utility>

#include "costate/element/kind/joint_axes.h"

namespace costate {

void add_cylindrical(MechanismBuilder& builder, const std::string& name,
                     const std::pair<std::string, std::string>& points, const JointAxes& axes);
void add_translational(MechanismBuilder& builder, const std::string& name,
                       const std::pair<std::string, std::string>& points, const JointAxes& axes);

}  // namespace costate
