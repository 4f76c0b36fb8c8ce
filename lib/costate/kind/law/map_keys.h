// Maps, functions of two arguments that formulas call: cx = { kind = "map", ... } beside the formula "q*cx(rpm, load)".
#pragma once

#include <memory>
#include <string>

#include "costate/element/law/point_surface.h"
#include "costate/scene/scene_table.h"

namespace costate {

struct MapOptions {
  std::shared_ptr<const PointSurface> surface;
  double scale = 1;  // a number, "cx.scale"
};

/// Whether the table under this key is a map.
bool is_map(SceneTable& table, const std::string& key);
MapOptions read_map(SceneTable table);

}  // namespace costate
