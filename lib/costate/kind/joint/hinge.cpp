#include "costate/kind/joint/hinge.h"

#include "costate/scene/scene_kind.h"

namespace costate {

namespace {
const JointRecipe kHinge = {"hinge", JointRecipe::Place::together, DirectionsConstraint::Condition::parallel, true};
const JointRecipe kUniversal = {"universal", JointRecipe::Place::together,
                                DirectionsConstraint::Condition::perpendicular};
}  // namespace

void add_hinge(MechanismBuilder& builder, const std::string& name, const std::pair<std::string, std::string>& points,
               const JointAxes& axes, const std::optional<JointCoordinate>& angle) {
  add_joint(builder, kHinge, name, points, axes, {angle});
}

void add_universal(MechanismBuilder& builder, const std::string& name,
                   const std::pair<std::string, std::string>& points, const JointAxes& axes) {
  add_joint(builder, kUniversal, name, points, axes);
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
    .phase_of = joint_phase,
    .summary = "a revolute joint in space: two points and two axes coincide; it can have an angle coordinate",
    .example = bodies + R"(
[hinge.base]
points = ["A", "base"]
axis_first = [1, 0.2, 0.1]

[hinge.elbow]
points = ["end", "wrist"]
axis_first = [0, 0.1, 1]
axis_second = [0.1, 0, 1]
normal_first = [1, 0.2, 0]
normal_second = [1, 0, 0.3]
angle = "flexion"
angular_velocity_rad_per_s = 0.5

[torsion_spring.tendon]
angle = "flexion"
stiffness_N_m_per_rad = 3
natural_angle_rad = 0.4
damping_N_m_s_per_rad = 0.2

[start]
given = ["frame.e1", "flexion.angle"]
given_velocities = ["frame.omega_x", "flexion.angle"]
)",
    .add = [](const std::string& name, SceneTable& table,
              MechanismBuilder& builder) { read_joint(kHinge, name, table, builder); },
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
    .add = [](const std::string& name, SceneTable& table,
              MechanismBuilder& builder) { read_joint(kUniversal, name, table, builder); },
});

}  // namespace

}  // namespace costate
