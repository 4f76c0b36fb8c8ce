// Other versions of a scene in which it should behave as well: in other units of length, with slow and fast starts,
// over a long time, with parameters at their bounds.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "costate/scene/scene.h"

namespace costate::app {

/// The power of length in a unit: 1 for "m", 2 for "J" or "N m", -1 for "Pa", 0 for "N/m"; nothing for an unknown unit.
std::optional<int> length_power(const std::string& unit);

struct RescaledScene {
  std::vector<std::string> overrides;  // PATH=VALUE for the scene with every length `factor` times as large in numbers
  std::string why_not;                 // or why it cannot be rescaled
};
/// In units of length of 1/factor m, kg and s: the same motion, written in other numbers.
RescaledScene rescaled(const Scene& scene, double factor);

/// PATH=VALUE with all given velocities `factor` times as large; empty where all are zero.
std::vector<std::string> faster(const Scene& scene, double factor);

/// PATH=VALUE with all stiffnesses of springs (of contacts) `factor` times as large.
std::vector<std::string> stiffer(const Scene& scene, double factor, bool contacts);
/// The last mass of the scene, with the moments of inertia of its body, `factor` times as large.
std::vector<std::string> heavier(const Scene& scene, double factor);
/// Angular velocities at the start (given ones and spins of rotors) as fast as this [rad/s], in their sense; empty
/// where all are zero.
std::vector<std::string> spinning(const Scene& scene, double rate);

}  // namespace costate::app
