// [axis_spring.NAME]: a spring and damper on the displacement of the point `to` from the point `from` along
// an axis fixed in from's body (or in the ground): x = axis . A^T (r_to - r_from), of either sign. It has the
// keys and the law of [spring] with x for the length. The force acts at `to` along the axis, its reaction on
// from's body at the same place.
#pragma once

#include <array>
#include <string>

#include "costate/kind/force/spring.h"

namespace costate {

/// axis: of any length but zero, in the frame of from's body.
void add_axis_spring(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
                     const std::array<double, 3>& axis, const SpringOptions& options);

}  // namespace costate
