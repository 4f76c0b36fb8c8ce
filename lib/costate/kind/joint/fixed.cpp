#include "costate/kind/joint/fixed.h"

#include "costate/scene/scene_kind.h"

namespace costate {

namespace {
const JointRecipe kFixed = {"fixed", JointRecipe::Place::together, DirectionsConstraint::Condition::aligned};
}  // namespace

void add_fixed(MechanismBuilder& builder, const std::string& name, const std::pair<std::string, std::string>& points,
               const std::optional<JointAxes>& axes) {
  const JointBuilder joint(builder, kFixed.kind, name, points);
  add_joint(builder, kFixed, name, points, axes ? *axes : joint.axes_of_first_poses());
}

namespace {

const RegisterSceneKind fixed_registered({
    .name = "fixed",
    .phase = ScenePhase::elements,
    .summary = "a weld in space: two points coincide and the bodies do not turn against each other, from how they "
               "first stand or, "
               "with axes, from where these and the normals (without normals all directions) agree",
    .example = R"(
[gravity]
y_m_per_s2 = 1
z_m_per_s2 = -9.81

[rigid_body.mast]
x_m = 0
y_m = 0
z_m = 0.5
rotation_axis = [1, 0, 0.2]
angle_rad = 0.3
omega_x_rad_per_s = 1
mass_kg = 2
inertia_xx_kg_m2 = 0.2
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.3
center_y_m = 0.1

[rigid_body.spar]
x_m = 0.2
y_m = 0
z_m = 1
rotation_axis = [0, 1, 0.3]
angle_rad = 1.1
mass_kg = 1
inertia_xx_kg_m2 = 0.05
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1

[rigid_body.flag]
x_m = 1
y_m = 0
z_m = 1
mass_kg = 0.2
inertia_xx_kg_m2 = 0.01
inertia_yy_kg_m2 = 0.01
inertia_zz_kg_m2 = 0.01

[point.A]
ground = true
x_m = 0
y_m = 0
z_m = 0

[point.foot]
on = "mast"
x_m = 0
y_m = 0
z_m = -0.5

[point.top]
on = "mast"
x_m = 0
y_m = 0
z_m = 0.5

[point.root]
on = "spar"
x_m = 0.1
y_m = 0
z_m = -0.2

[point.end]
on = "spar"
x_m = -0.3
y_m = 0
z_m = 0.9

[point.hem]
on = "flag"
x_m = 0
y_m = 0.1
z_m = 0

[spherical.foot]
points = ["A", "foot"]

[fixed.weld]
points = ["top", "root"]

[fixed.seam]
points = ["end", "hem"]
axis_first = [0, 1, 0]
axis_second = [1, 0, 0]
normal_first = [1, 0, 0.2]
normal_second = [0, 1, 0]

[start]
given = ["mast.e1", "mast.e2", "mast.e3"]
given_velocities = ["mast.omega_x", "mast.omega_y", "mast.omega_z"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          if (table.has("axis_first")) return read_joint(kFixed, name, table, builder);
          add_fixed(builder, name, table.text_pair("points"));
        },
});

}  // namespace

}  // namespace costate
