// A mass on a massless bar of 1 m that turns at w = 3 rad/s without gravity for 2 s: x = cos(w t), y = sin(w t), and
// psi the integral of x^2.
#pragma once

#include <string>

namespace costate::test {

inline const std::string kTurning = R"(title = "Turning"

[point.O]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 1
y_m = 0
vy_m_per_s = 3

[mass.bob]
point = "P"
mass_kg = 2

[distance.rod]
from = "O"
to = "P"

[start]
given = ["P.y"]

[[cost.running]]
kind = "square"
output = "P.x"

[parameter.w]
number = "point.P.vy_m_per_s"

[run]
t_end_s = 2
parameters = ["w"]
)";

}  // namespace costate::test
