// [force.NAME]: a force on a point with components in the ground frame or, in space, in that of the point's body;
// [couple.NAME]: a torque on one angle, or between two, or a couple with three components on a rigid body, or between
// two. Each is a number or a law of time. `with_work`: they
// integrate the work that they do, the output NAME.work.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "costate/element/force/spatial_force.h"
#include "costate/kind/law/law_options.h"

namespace costate {

void add_force(MechanismBuilder& builder, const std::string& name, const std::string& point, const LawOptions& x_N,
               const LawOptions& y_N, bool with_work = false);

/// Turns the (second) angle forward for a positive torque, the first of two backward.
void add_couple(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                const LawOptions& torque_N_m, bool with_work = false);

/// At a point of space; ForceFrame::body: the components turn with the point's body.
void add_spatial_force(MechanismBuilder& builder, const std::string& name, const std::string& point,
                       const std::array<LawOptions, 3>& force_N, ForceFrame frame = ForceFrame::ground,
                       bool with_work = false);

/// On one rigid body, or on the second of two with its reaction on the first; ForceFrame::body: in the frame of the
/// first.
void add_spatial_couple(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& bodies,
                        const std::array<LawOptions, 3>& torque_N_m, ForceFrame frame = ForceFrame::ground,
                        bool with_work = false);

}  // namespace costate
