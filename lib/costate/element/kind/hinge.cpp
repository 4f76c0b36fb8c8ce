#include "costate/element/kind/hinge.h"

#include "costate/scene/scene_kind.h"

namespace costate {

void add_hinge(MechanismBuilder& builder, const std::string& name,
               const std::pair<std::string, std::string>& points, const JointAxes& axes) {
  JointBuilder joint(builder, "hinge", name, points);
  joint.set_axes(axes);
  joint.keep_together();
  joint.keep_directions(DirectionsConstraint::Condition::parallel);
}

void add_universal(MechanismBuilder& builder, const std::string& name,
                   const std::pair<std::string, std::string>& points, const JointAxes& axes) {
  JointBuilder joint(builder, "universal", name, points);
  joint.set_axes(axes);
  joint.keep_together();
  joint.keep_directions(DirectionsConstraint::Condition::perpendicular);
}

namespace {

const std::string bodies = R"(
[gravity]
y_m_per_s2 = 1
z_m_per_s2 = -9.81

[rigid_body.frame]
x_m = 0.5
y_m = 0
z_m = 0
rotation_axis = [1, 0.2, 0]
angle_rad = 0.3
mass_kg = 2
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.3

[rigid_body.arm]
x_m = 1
y_m = 0.4
z_m = 0
rotation_axis = [0, 0, 1]
angle_rad = 1.5
mass_kg = 1
inertia_xx_kg_m2 = 0.05
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1

[point.A]
ground = true
x_m = 0
y_m = 0
z_m = 0

[point.base]
on = "frame"
x_m = -0.5
y_m = 0
z_m = 0

[point.end]
on = "frame"
x_m = 0.5
y_m = 0
z_m = 0

[point.wrist]
on = "arm"
x_m = -0.4
y_m = 0
z_m = 0.1
)";

const RegisterSceneKind hinge({
    .name = "hinge",
    .phase = ScenePhase::elements,
    .summary = "a revolute joint in space: two points and two axes coincide",
    .example = bodies + R"(
[hinge.base]
points = ["A", "base"]
axis_first = [1, 0.2, 0.1]

[hinge.elbow]
points = ["end", "wrist"]
axis_first = [0, 0.1, 1]
axis_second = [0.1, 0, 1]

[start]
given = ["frame.e1", "arm.e3"]
given_velocities = ["frame.omega_x", "arm.omega_z"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const auto points = table.text_pair("points");
          add_hinge(builder, name, points, read_axes(table));
        },
});

const RegisterSceneKind universal({
    .name = "universal",
    .phase = ScenePhase::elements,
    .summary = "a cardan joint: two points coincide, two axes stay perpendicular",
    .example = bodies + R"(
[universal.base]
points = ["A", "base"]
axis_first = [0, 0, 1]
axis_second = [0, 1, 0]

[universal.elbow]
points = ["end", "wrist"]
axis_first = [0, 1, 0.1]
axis_second = [0, 0.2, 1]

[start]
given = ["frame.e2", "frame.e3", "arm.e2", "arm.e3"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const auto points = table.text_pair("points");
          JointAxes axes;
          axes.first = read_direction(table, "axis_first");
          axes.second = read_direction(table, "axis_second");
          add_universal(builder, name, points, axes);
        },
});

}  // namespace

}  // namespace costate
