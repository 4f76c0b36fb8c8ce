// Units of multipliers. A row's multiplier is a generalized force over the row's derivative, lambda Phi_q, and the
// row's powers of a length show when all lengths are taken twice: distances are in m^2 and give N/m, coincidences N,
// drivers N or N m with their coordinate, conditions on directions N m.
#pragma once

#include <string>
#include <vector>

#include "costate/mechanism/mechanism.h"

namespace costate {

/// One a row: "N", "N m", "N/m"; empty where a row mixes units (a driver of a weighted sum of lengths and angles).
std::vector<std::string> multiplier_units(const Mechanism& mechanism);
/// One a force state, as its element says.
std::vector<std::string> state_units(const Mechanism& mechanism);

}  // namespace costate
