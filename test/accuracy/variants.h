// Shipped scenes with other numbers, starts, ends and parameters, drawn at random within reason.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "costate/scene/scene.h"

namespace costate::accuracy {

struct Variant {
  std::string family;  // "five-bar"
  Scene scene;
  std::vector<std::string> parameters;  // of the gradient; empty: a simulation is asked for
  bool vehicle = false;                 // seconds a run, not milliseconds
};

bool is_vehicle(std::uint64_t number);
/// The same for the same number. Throws where the numbers drawn give no scene that starts.
Variant draw_variant(std::uint64_t number);

}  // namespace costate::accuracy
