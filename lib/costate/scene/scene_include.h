// A scene made of several files: `include = ["vehicle.toml"]` at the top reads those first, in order (paths are
// relative to the file that names them), and lays the file's own keys over theirs, table by table: a value, an array
// or a table in braces takes the place of the one below it. `remove = ["tyre.FL", "run.outputs"]` takes away what was
// included. A run is then a few lines beside the vehicle it is a run of.
#pragma once

#include <string>

#include "costate/scene/scene_node.h"

namespace costate {

/// Throws SceneError for a file that cannot be read.
std::string read_scene_text(const std::string& path);

/// The tree of a scene's text with everything it includes; nodes keep their own file as their place. Throws SceneError
/// for files that cannot be read or include each other, and for removed paths that do not exist.
SceneNode read_with_includes(const std::string& text, const std::string& file_name);

}  // namespace costate
