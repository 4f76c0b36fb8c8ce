#include "costate/mechanism/length_size.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "costate/base/power_of_ten.h"

namespace costate {

double length_size(const Mechanism& mechanism) {
  double largest = 0;
  const auto is_length = [](const std::string& path) {  // "length_m", but neither "..._N_per_m" nor "..._N_m"
    return path.ends_with("_m") && !path.ends_with("_per_m") && !path.ends_with("_N_m");
  };
  for (const Number& n : mechanism.numbers())
    if (is_length(n.path)) largest = std::max(largest, std::abs(n.value));
  for (const Coordinate& c : mechanism.coordinates())
    if (c.unit == "m")
      largest = std::max(largest, std::abs(mechanism.numbers()[static_cast<std::size_t>(c.position_number)].value));
  if (largest >= 0.1 || largest == 0) return 1;
  return power_of_ten_above(largest);
}

std::vector<double> coordinate_levers(const Mechanism& mechanism, double length) {
  std::vector<double> levers;
  for (const Coordinate& c : mechanism.coordinates()) levers.push_back(c.unit == "m" ? 1 : length);
  return levers;
}

}  // namespace costate
