// Small scenes made for 'costate stress': chains of many bodies, a chaotic motion over longer and longer times, springs
// of very different stiffness in a row, rows that are redundant or nearly so.
#pragma once

#include <string>
#include <vector>

namespace costate::app {

/// The axis whose members are run with their gradients.
inline constexpr const char* kChaoticHorizon = "chaotic horizon";

struct StressFamily {
  std::string axis, value;
  std::string text;  // of the scene
};

/// The axes there are, in the order of the members.
const std::vector<std::string>& family_axes();
/// The members of an axis, the mildest first.
std::vector<StressFamily> family_of(const std::string& axis);

}  // namespace costate::app
