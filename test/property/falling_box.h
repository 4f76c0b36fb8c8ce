// A box in space that falls without turning and strikes rigid ground with a corner.
#pragma once

namespace costate::test {

constexpr const char* kFallingBox = R"(
[gravity]
z_m_per_s2 = -9.81
[rigid_body.box]
x_m = 0
y_m = 0
z_m = 0.7
mass_kg = 1.4
inertia_xx_kg_m2 = 0.03
inertia_yy_kg_m2 = 0.05
inertia_zz_kg_m2 = 0.06
[point.corner]
on = "box"
x_m = 0.1
y_m = 0.2
z_m = -0.2
[contact.floor]
kind = "rigid"
point = "corner"
restitution = 0.6
closing_speed_m_per_s = 0
[start]
given = ["box"]
[run]
t_end_s = 0.5
rtol = 1e-11
parameters = ["contact.floor.restitution", "rigid_body.box.mass_kg", "rigid_body.box.inertia_xx_kg_m2", "rigid_body.box.z_m"]
[[cost.terminal]]
kind = "value"
output = "box.z"
)";

}  // namespace costate::test
