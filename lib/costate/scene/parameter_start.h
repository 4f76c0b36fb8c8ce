// Where a parameter starts against its bounds.
#pragma once

#include "costate/mechanism/parameter.h"
#include "costate/scene/scene_node.h"
#include "costate/scene/scene_table.h"

namespace costate {

/// A scene's own start outside the bounds is a mistake in it. One that an override has put there (`number`, what it is
/// taken from) is allowed, with a notice: simulations do not mind, the optimizer does.
void check_start(const Parameter& p, double start, const SceneNode* number, const SceneTable& table);

}  // namespace costate
