// Units as FMI has them: exponents of SI's base units.
#pragma once

#include <string>

namespace costate::app {

/// The attributes of a BaseUnit, 'kg="1" s="-2"' for "N/m"; empty where a symbol is none of kg, m, s, rad, K, N, J, W,
/// Pa, Hz.
std::string base_unit_attributes(const std::string& unit);

/// Of the rate of what has this unit ("" or "1": none): "m/s^2" for "m/s", "N/(m s)" for "N/m".
std::string unit_of_rate(const std::string& unit);

}  // namespace costate::app
