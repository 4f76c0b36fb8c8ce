// Writes the tree of a scene as TOML text in the order of the file it came from, every number with the
// shortest digits that read back to the same bits. Comments are not kept.
#pragma once

#include <string>
#include <vector>

#include "costate/scene/scene_node.h"

namespace costate {

std::string write_toml(const SceneNode& root);

/// One value as it stands right of '=', on one line.
std::string toml_value(SceneNode node);

/// The values of a table as "path=value": dotted keys, quoted or not, and tables below it with headers of their own.
void add_overrides(const SceneNode& table, const std::string& path, std::vector<std::string>& out);

/// A floating-point number as TOML text; reads back to the same bits, and as a floating-point number.
std::string toml_number(double x);

}  // namespace costate
