#include "costate/mechanism/force_size.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string>
#include <string_view>

#include "costate/base/library_class.h"
#include "costate/base/power_of_ten.h"
#include "costate/mechanism/length_size.h"

namespace costate {

namespace {
// What is heavier is tolerated as all else.
constexpr double kLight = 1e-3;
constexpr double kWeight = 10;  // of a kilogram [N]

/// A unit at the end of a number's name, the force that one of it makes over the length L, and in 1 s: factor L^power.
struct UnitOfForce {
  std::string_view end;
  double factor;
  int power;
};
// Longer ones before those that they end with.
constexpr std::array kUnits{UnitOfForce{"_kg_m2", 1, -1},         UnitOfForce{"_kg_m", kWeight, 0},
                            UnitOfForce{"_kg", kWeight, 0},       UnitOfForce{"_kg_per_m", kWeight, 1},
                            UnitOfForce{"_N_m_s_per_rad", 1, -1}, UnitOfForce{"_N_m_per_rad", 1, -1},
                            UnitOfForce{"_N_m", 1, -1},           UnitOfForce{"_N_s_per_m", 1, 1},
                            UnitOfForce{"_N_per_m", 1, 1},        UnitOfForce{"_N", 1, 0}};

/// A length, an angle, a time or a rate of them.
bool is_of_motion(std::string_view path) {
  constexpr std::string_view ends[] = {"_m", "_rad", "_s", "_Hz", "_per_s2"};
  return std::any_of(std::begin(ends), std::end(ends), [&](std::string_view end) { return path.ends_with(end); });
}
}  // namespace

double force_size(const Mechanism& mechanism) {
  for (const auto& force : mechanism.forces())
    if (!is_wholly_of_library(typeid(*force))) return 1;
  const double length = length_size(mechanism);
  double largest = 0;
  for (const Number& n : mechanism.numbers()) {
    const auto unit = std::find_if(kUnits.begin(), kUnits.end(),
                                   [&](const UnitOfForce& u) { return std::string_view(n.path).ends_with(u.end); });
    if (unit != kUnits.end())
      largest = std::max(largest, std::abs(n.value) * unit->factor * std::pow(length, unit->power));
    else if (is_of_motion(n.path))
      continue;
    else if (std::string_view(n.path).find("_N") != std::string_view::npos || n.path.starts_with("force.") ||
             n.path.starts_with("couple.") || n.path.starts_with("actuator."))
      largest = std::max(largest, std::abs(n.value));  // of another unit, or of a formula
  }
  if (largest >= kLight || largest == 0) return 1;
  return power_of_ten_above(largest);
}

}  // namespace costate
