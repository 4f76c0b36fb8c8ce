// Where a parameter starts against its bounds.
#pragma once

#include "costate/mechanism/parameter.h"
#include "costate/scene/scene_node.h"
#include "costate/scene/scene_table.h"

namespace costate {

/// A scene's own start outside the bounds is a mistake in it. One that an override has put there (`number`, the path of
/// what it is taken from) is allowed, with a notice: simulations do not mind, the optimizer does. The number is looked
/// for in the scene's tree, in a time like the tree's size, only where the start is outside.
void check_start(const Parameter& p, double start, const SceneNode& root, const std::string& number,
                 const SceneTable& table);

}  // namespace costate
