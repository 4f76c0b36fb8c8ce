// Random scenes of the plane whose bodies touch ground that gives: every law of a normal force with every model of
// friction, points and arcs, falling, just touching and pressed at the start, judged by differences of re-read scenes.
#pragma once

#include <cstdint>

#include "kinds.h"

namespace costate::adversary {

/// Empty text where the dice gave a scene that cannot be read.
KindScene random_touch_scene(std::uint64_t seed);

}  // namespace costate::adversary
