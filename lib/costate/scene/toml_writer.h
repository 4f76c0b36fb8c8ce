// Writes the tree of a scene as TOML text in the order of the file it came from, every number with the
// shortest digits that read back to the same bits. Comments are not kept.
#pragma once

#include <string>

#include "costate/scene/scene_node.h"

namespace costate {

std::string write_toml(const SceneNode& root);

/// A floating-point number as TOML text; reads back to the same bits, and as a floating-point number.
std::string toml_number(double x);

}  // namespace costate
