// A scene for tests: one degree of freedom at rest, with a row that can be made redundant.
#pragma once

#include <string>

namespace costate::test {

/// A beam that hangs from two parallel posts, pulled aside by a damped spring.
inline const std::string hanging_beam = R"(
[gravity]
y_m_per_s2 = -9.81
[point.A0]
ground = true
x_m = 0
y_m = 0
[point.A1]
ground = true
x_m = 1
y_m = 0
[point.A2]
ground = true
x_m = 2
y_m = 0
[body.beam]
x_m = 0.3
y_m = -0.9
mass_kg = 3
inertia_kg_m2 = 0.8
center_x_m = 0.9
[point.B0]
on = "beam"
x_m = 0
y_m = 0
[point.B1]
on = "beam"
x_m = 1
y_m = 0
[point.B2]
on = "beam"
x_m = 2
y_m = 0
[distance.left]
from = "A0"
to = "B0"
length_m = 1
[distance.right]
from = "A2"
to = "B2"
length_m = 1
[spring.S]
from = "A2"
to = "B1"
stiffness_N_per_m = 50
natural_length_m = 1
damping_N_s_per_m = 2
[start]
equilibrium = true
)";
/// One more post for it, which says nothing new.
inline const std::string middle_post = "\n[distance.middle]\nfrom = \"A1\"\nto = \"B1\"\nlength_m = 1\n";

}  // namespace costate::test
