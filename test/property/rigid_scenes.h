// Scenes with rigid contacts that stay closed and let go, for gradients and second derivatives.
#pragma once

namespace costate::test {

// A block on rough ground that another one pulls by a spring to and fro: it sticks, slides and sticks again.
inline const char* const kPulledBlock = R"(
[gravity]
y_m_per_s2 = -9.81
[point.block]
x_m = 0
y_m = 0
[mass.block]
point = "block"
mass_kg = 0.5
[point.puller]
x_m = 0.9
y_m = 0.3
vx_m_per_s = 1.5
[mass.puller]
point = "puller"
mass_kg = 1.5
[spring.S]
from = "block"
to = "puller"
stiffness_N_per_m = 30
damping_N_s_per_m = 0.2
natural_length_m = 0.95
[point.nail]
ground = true
x_m = 0.8
y_m = 2
[spring.hanger]
from = "nail"
to = "puller"
stiffness_N_per_m = 40
natural_length_m = 1.4
[contact.floor]
kind = "rigid"
point = "block"
closed = true
along_m = 0
ground_angle_rad = 0.05
friction = "coulomb"
friction_coefficient = 0.8
[start]
given = ["puller.x", "puller.y"]
[run]
t_end_s = 1.5
rtol = 1e-11
parameters = ["mass.block.mass_kg", "mass.puller.mass_kg", "spring.S.stiffness_N_per_m", "spring.S.natural_length_m", "spring.S.damping_N_s_per_m", "contact.floor.ground_angle_rad", "contact.floor.friction_coefficient", "gravity.y_m_per_s2", "point.puller.x_m"]
[[cost.running]]
kind = "square"
output = "block.x"
target = 0.4
[[cost.running]]
kind = "square"
output = "floor.friction_force"
weight = 1e-3
[[cost.terminal]]
kind = "value"
output = "floor.normal_force"
weight = 1e-2
)";

// A mass on the ground under a heavier one on a spring, which lifts it: it opens, flies and closes again.
inline const char* const kHopper = R"(
[gravity]
y_m_per_s2 = -9.81
[point.foot]
x_m = 0
y_m = 0
[mass.foot]
point = "foot"
mass_kg = 0.5
[point.top]
x_m = 0.1
y_m = 0.45
[mass.top]
point = "top"
mass_kg = 2
[spring.leg]
from = "foot"
to = "top"
stiffness_N_per_m = 300
damping_N_s_per_m = 0.4
natural_length_m = 0.8
[contact.floor]
kind = "rigid"
point = "foot"
FRICTION
closed = true
[start]
given = GIVEN
[run]
t_end_s = 1.1
rtol = 1e-11
parameters = ["mass.foot.mass_kg", "mass.top.mass_kg", "spring.leg.stiffness_N_per_m", "spring.leg.natural_length_m", "spring.leg.damping_N_s_per_m", "contact.floor.ground_angle_rad", "contact.floor.ground_height_m", "gravity.y_m_per_s2", "point.top.x_m"]
[[cost.running]]
kind = "square"
output = "top.y"
target = 0.4
[[cost.terminal]]
kind = "value"
output = "top.x"
)";

// A hanging rod of two parts over a slope.
inline const char* const kRods = R"([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[body.upper]
x_m = 0.5
y_m = 0
mass_kg = 1.2
inertia_kg_m2 = 0.1
[body.lower]
x_m = 1.4
y_m = 0.1
angle_rad = 0.3
mass_kg = 0.8
inertia_kg_m2 = 0.06
[point.hip]
on = "upper"
x_m = -0.5
y_m = 0
[point.knee]
on = "upper"
x_m = 0.5
y_m = 0
[point.top]
on = "lower"
x_m = -0.41
y_m = -0.02
[point.tip]
on = "lower"
x_m = 0.4
y_m = 0.05
[revolute.hip]
points = ["O", "hip"]
[revolute.knee]
points = ["knee", "top"]
[contact.floor]
kind = "rigid"
point = "tip"
ground_height_m = -0.6
ground_angle_rad = 0.15
CONTACT
[start]
given = ["upper.angle", "lower.angle"]
[run]
t_end_s = END
rtol = 1e-11
parameters = ["slope", "m", "J", "x", "g"]
[parameter.slope]
number = "contact.floor.ground_angle_rad"
[parameter.m]
number = "body.lower.mass_kg"
[parameter.J]
number = "body.upper.inertia_kg_m2"
[parameter.x]
number = "point.tip.x_m"
[parameter.g]
number = "gravity.y_m_per_s2"
factors = [-1]
[[cost.terminal]]
kind = "square"
output = "lower.angle_dot"
[[cost.running]]
kind = "square"
output = "upper.angle_dot"
)";

}  // namespace costate::test
