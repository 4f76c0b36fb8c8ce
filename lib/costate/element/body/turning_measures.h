// What bodies in space report of their turning, whatever their coordinates.
#pragma once

#include <vector>

#include "costate/element/element.h"

namespace costate {

/// Angular velocity in the body's frame (0 .. 2) and in the ground's (3 .. 5), CardanAngle (6 .. 8), angular
/// acceleration as the velocity (9 .. 14).
inline std::vector<Measure> turning_measures() {
  std::vector<Measure> all;
  const auto add = [&](const char* name, const char* unit, bool needs_accelerations) {
    for (const char* axis : {"x", "y", "z"}) all.push_back({std::string(name) + axis, unit, needs_accelerations});
  };
  add("omega_", "rad/s", false);
  add("omega_global_", "rad/s", false);
  for (const char* angle : {"roll", "pitch", "yaw"}) all.push_back({angle, "rad", false});
  add("alpha_", "rad/s^2", true);
  add("alpha_global_", "rad/s^2", true);
  return all;
}

}  // namespace costate
