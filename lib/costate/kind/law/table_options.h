// Options that several kinds read from their tables in the same way.
#pragma once

#include <string>
#include <vector>

#include "costate/scene/scene_table.h"

namespace costate {

/// angle = "crank" or angles = ["frame", "crank"].
inline std::vector<std::string> read_angles(SceneTable& table) {
  if (!table.has("angles")) return {table.text("angle")};
  if (table.has("angle")) table.fail("angle", "contradicts 'angles': give one of them.");
  const auto pair = table.text_pair("angles");
  return {pair.first, pair.second};
}

}  // namespace costate
