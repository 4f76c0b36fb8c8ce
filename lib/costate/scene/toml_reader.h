// Reads TOML text into the ordered tree of a scene. The only part of the library that knows the TOML parser.
#pragma once

#include <string>

#include "costate/scene/scene_node.h"

namespace costate {

/// Throws SceneError with the place of a syntax error.
SceneNode read_toml(const std::string& text, const std::string& file_name);

/// A single value as it stands right of '='; text without quotes that is no TOML value is taken as a string.
SceneNode read_toml_value(const std::string& text, const std::string& source_name);

}  // namespace costate
