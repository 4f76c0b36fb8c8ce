// Units as texts: those that measurements come in, by SI; and what units of SI, "N m/rad", are made of.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace costate {

/// What one of a unit is, in which unit of SI: "deg" is 0.01745... of "rad".
struct InSi {
  double factor;
  const char* unit;
};
/// Null for a unit that is not known.
const InSi* in_si(const std::string& unit);
std::vector<std::string> known_units();

/// Of kg, m, s, rad, K.
using UnitExponents = std::array<int, 5>;
inline constexpr std::array<const char*, 5> kBaseUnits = {"kg", "m", "s", "rad", "K"};

/// Of a product of kg, m, s, rad, K, N, J, W, Pa, Hz and 1, "/" and what follows it below: "m/s^2", "N/(m s)". Nothing
/// where a symbol is none of these.
std::optional<UnitExponents> unit_exponents(const std::string& unit);

/// Whether both are known and of different kinds; angles are numbers, and "" and "1" say nothing.
bool units_disagree(const std::string& a, const std::string& b);

}  // namespace costate
