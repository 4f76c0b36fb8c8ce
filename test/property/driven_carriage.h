#pragma once

#include <fmt/format.h>

#include <string>

namespace costate::test {

/// A carriage that a law moves along x, and a heavy rod that hangs on it with a damper: the driven velocity
/// jumps at each kink, and with it the rod's rate, by its masses.
inline std::string driven_carriage(const std::string& law) {
  return fmt::format(R"([gravity]
y_m_per_s2 = -9.81

[body.carriage]
x_m = 0
y_m = 0
angle_rad = 0
mass_kg = 2
inertia_kg_m2 = 0.1

[body.rod]
x_m = 0.3
y_m = -0.4
angle_rad = 0.2
mass_kg = 1.5
inertia_kg_m2 = 0.08

[point.eye]
on = "carriage"
x_m = 0
y_m = 0

[point.top]
on = "rod"
x_m = -0.4
y_m = 0.3

[point.end]
on = "rod"
x_m = 0.4
y_m = -0.2

[point.wall]
ground = true
x_m = 1
y_m = 0.5

[revolute.pin]
points = ["eye", "top"]

[driver.level]
coordinate = "carriage.y"
law = 0

[driver.straight]
coordinate = "carriage.angle"
law = 0

[driver.push]
coordinate = "carriage.x"
law = {}

[spring.strut]
from = "end"
to = "wall"
stiffness_N_per_m = 30
natural_length_m = 0.8
damping_N_s_per_m = 2

[start]
given = ["rod.angle"]

[[cost.running]]
kind = "square"
output = "rod.angle"

[[cost.terminal]]
kind = "square"
output = "rod.angle_dot"

[run]
t_end_s = 1.2
rtol = 1e-9
)",
                     law);
}

}  // namespace costate::test
