// The frame of a bushing whose body is written as a part of another one.
#pragma once

#include <Eigen/Core>
#include <string>

#include "costate/scene/scene_node.h"

namespace costate::app {

/// Writes rotation_axis_END and angle_END_rad of [bushing.NAME] (`path`, as it stands in `t`): its frame in the body at
/// `end`, "from" or "to", whose base vectors R gives in the body that it becomes a part of.
void turn_bushing_frame(SceneNode& root, const std::string& path, const SceneNode& t, const std::string& end,
                        const Eigen::Matrix3d& R);

}  // namespace costate::app
