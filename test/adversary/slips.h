// Random scenes with one rigid contact that slides, sticks, bounces or stays, of a body of the plane or of a point or a
// body in space, thrown or on the ground, judged by differences of re-read scenes.
#pragma once

#include <cstdint>

#include "kinds.h"

namespace costate::adversary {

/// Of a point in space that rests at the start, and is made to slide.
KindScene random_rest_scene(std::uint64_t seed);
/// Empty text where the dice gave a scene that cannot be read.
KindScene random_slip_scene(std::uint64_t seed);

}  // namespace costate::adversary
