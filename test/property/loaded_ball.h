// A ball that spins, whose centre of mass is not its own, on rough ground or above it: HEIGHT, STATE of the contact,
// GIVEN at the start, END.
#pragma once

namespace costate::test {

inline const char* const kLoadedBall = R"([gravity]
z_m_per_s2 = -9.81
[rigid_body.ball]
x_m = 0
y_m = 0
z_m = HEIGHT
e0 = 0.8
e1 = 0.2
e2 = -0.4
e3 = 0.4
mass_kg = 1.5
inertia_xx_kg_m2 = 0.006
inertia_yy_kg_m2 = 0.007
inertia_zz_kg_m2 = 0.0065
vx_m_per_s = 1.2
vy_m_per_s = -0.5
omega_global_x_rad_per_s = 3
omega_global_y_rad_per_s = -2
omega_global_z_rad_per_s = 5
[point.C]
on = "ball"
x_m = 0.01
y_m = 0
z_m = 0.02
[contact.floor]
kind = "rigid"
point = "C"
radius_m = 0.1
friction = "coulomb"
friction_coefficient = 0.2
STATE
[start]
GIVEN
[run]
t_end_s = END
rtol = 1e-10
parameters = ["contact.floor.friction_coefficient", "rigid_body.ball.mass_kg", "rigid_body.ball.inertia_yy_kg_m2", "rigid_body.ball.vx_m_per_s"]
[[cost.terminal]]
kind = "value"
output = "ball.x"
[[cost.terminal]]
kind = "value"
output = "ball.y"
weight = 2
[[cost.terminal]]
kind = "value"
output = "ball.omega_x"
weight = 0.05
)";

}  // namespace costate::test
