// Random scenes of what registers itself: the example that each kind of element brings along, with numbers
// changed at random, costs on any of its outputs and parameters among all its numbers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace costate::adversary {

/// The same motion, written in another way.
struct KindVariant {
  std::string name, text;
  std::vector<std::string> parameters;
};

struct KindScene {
  std::string kind, text;
  std::vector<std::string> parameters;
  std::vector<KindVariant> variants;
};

/// Empty text where the dice gave a scene that cannot be read. `harder`: with numbers that change by orders of
/// magnitude, forces and costs that come late and are short, costs at the end, and variants.
KindScene random_kind_scene(std::uint64_t seed, bool harder);

}  // namespace costate::adversary
