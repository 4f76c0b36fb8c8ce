// Scenes at rest, for the tests of equilibria.
#pragma once

#include <string>

namespace costate::test {

inline const std::string hanging_mass = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 0.3
y_m = 0.4

[mass.bob]
point = "P"
mass_kg = 1.5

[spring.S]
from = "A"
to = "P"
stiffness_N_per_m = 120
natural_length_m = 0.9
damping_N_s_per_m = 3

[start]
equilibrium = true
)";

inline const std::string sprung_arm = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 0.6
y_m = 0.8

[bar.arm]
from = "A"
to = "P"
mass_kg = 2

[angle.crank]
bar = "arm"

[torsion_spring.hinge]
angle = "crank"
stiffness_N_m_per_rad = 20
natural_angle_rad = 0.5

[start]
equilibrium = true
)";

/// A plate that hangs from four points above its corners, its centre of mass off the middle; a Maxwell
/// element beside.
inline const std::string hanging_plate = R"(
[gravity]
z_m_per_s2 = -9.81

[rigid_body.plate]
x_m = 0.05
y_m = -0.02
z_m = -0.8
rotation_axis = [1, 2, 3]
angle_rad = 0.2
mass_kg = 12
inertia_xx_kg_m2 = 0.9
inertia_yy_kg_m2 = 1.4
inertia_zz_kg_m2 = 2
center_x_m = 0.06
center_y_m = 0.03
center_z_m = -0.1

[point.A0]
ground = true
x_m = 0.5
y_m = 0.3
z_m = 0
[point.A1]
ground = true
x_m = 0.5
y_m = -0.3
z_m = 0
[point.A2]
ground = true
x_m = -0.5
y_m = 0.3
z_m = 0
[point.A3]
ground = true
x_m = -0.5
y_m = -0.3
z_m = 0.1

[point.B0]
on = "plate"
x_m = 0.5
y_m = 0.3
z_m = 0
[point.B1]
on = "plate"
x_m = 0.5
y_m = -0.3
z_m = 0
[point.B2]
on = "plate"
x_m = -0.5
y_m = 0.3
z_m = 0
[point.B3]
on = "plate"
x_m = -0.5
y_m = -0.3
z_m = 0

[spring.S0]
from = "A0"
to = "B0"
stiffness_N_per_m = 300
natural_length_m = 0.7
[spring.S1]
from = "A1"
to = "B1"
stiffness_N_per_m = 400
natural_length_m = 0.7
[spring.S2]
from = "A2"
to = "B2"
stiffness_N_per_m = 350
natural_length_m = 0.7
[spring.S3]
from = "A3"
to = "B3"
stiffness_N_per_m = 500
natural_length_m = 0.75

[maxwell.M]
from = "A0"
to = "B3"
stiffness_N_per_m = 100
natural_length_m = 1
damping_N_s_per_m = 40

[start]
equilibrium = true
)";

}  // namespace costate::test
