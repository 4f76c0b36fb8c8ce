#include "costate/kind/joint/spherical.h"

#include "costate/kind/joint/joint_axes.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_spherical(MechanismBuilder& builder, const std::string& name,
                   const std::pair<std::string, std::string>& points) {
  JointBuilder(builder, "spherical", name, points).keep_together();
}

namespace {

const RegisterSceneKind spherical_registered({
    .name = "spherical",
    .phase = ScenePhase::elements,
    .summary = "a ball joint: two points of space coincide",
    .example = R"(
[gravity]
z_m_per_s2 = -9.81

[rigid_body.upper]
x_m = 0
y_m = 0
z_m = -0.5
rotation_axis = [0, 1, 0]
angle_rad = 0.3
omega_z_rad_per_s = 1
mass_kg = 2
inertia_xx_kg_m2 = 0.4
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.2

[rigid_body.lower]
x_m = 0
y_m = 0
z_m = -1.5
mass_kg = 1
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1
center_x_m = 0.1

[point.A]
ground = true
x_m = 0.1
y_m = -0.2
z_m = 0.3

[point.top]
on = "upper"
x_m = 0.1
y_m = 0
z_m = 0.5

[point.bottom]
on = "upper"
x_m = 0
y_m = -0.1
z_m = -0.5

[point.head]
on = "lower"
x_m = 0.05
y_m = 0.1
z_m = 0.4

[point.tail]
on = "lower"
x_m = 0
y_m = 0
z_m = -0.6

[spherical.shoulder]
points = ["A", "top"]

[spherical.elbow]
points = ["bottom", "head"]

[spring.tie]
from = "A"
to = "head"
stiffness_N_per_m = 60
natural_length_m = 0.7
damping_N_s_per_m = 2

[maxwell.relaxation]
from = "top"
to = "tail"
stiffness_N_per_m = 300
natural_length_m = 1.5
damping_N_s_per_m = 40

[start]
given = ["upper.e1", "upper.e2", "upper.e3", "lower.e1", "lower.e2", "lower.e3"]
given_velocities = ["upper.omega_x", "upper.omega_y", "upper.omega_z", "lower.omega_x", "lower.omega_y", "lower.omega_z"]
)",
    .add = [](const std::string& name, SceneTable& table,
              MechanismBuilder& builder) { add_spherical(builder, name, table.text_pair("points")); },
});

}  // namespace

}  // namespace costate
