// A pendulum that is let go, until an event ends it.
#pragma once

#include <fmt/format.h>

#include <string>

namespace costate::test {

/// A point mass on a massless rod of 1.3 m, let go at rest 0.3 rad above the horizontal. `run`: more of [run], then
/// other tables.
inline std::string free_pendulum(const std::string& ends_when, const std::string& run) {
  return fmt::format(R"(
[gravity]
y_m_per_s2 = -9.81

[point.O]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 1
y_m = 0

[mass.bob]
point = "P"
mass_kg = 1

[bar.rod]
from = "O"
to = "P"
mass_kg = 0
length_m = 1.3

[angle.swing]
bar = "rod"
angle_rad = -0.3

[start]
given = ["swing.angle"]

[parameter.L]
number = "bar.rod.length_m"

[parameter.g]
number = "gravity.y_m_per_s2"
factors = [-1]

[run]
t_end_s = 3
ends_when = {}
{}
)",
                     ends_when, run);
}

}  // namespace costate::test
