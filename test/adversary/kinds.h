// Random scenes of what registers itself: the example that each kind of element brings along, with numbers
// changed at random, a cost on any of its outputs and parameters among all its numbers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace costate::adversary {

struct KindScene {
  std::string kind, text;
  std::vector<std::string> parameters;
};

/// Empty text where the dice gave a scene that cannot be read.
KindScene random_kind_scene(std::uint64_t seed);

}  // namespace costate::adversary
