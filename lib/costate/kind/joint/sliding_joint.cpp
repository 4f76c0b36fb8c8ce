#include "costate/kind/joint/sliding_joint.h"

#include "costate/scene/scene_kind.h"

namespace costate {

namespace {
using Place = JointRecipe::Place;
const JointRecipe kCylindrical = {"cylindrical", Place::on_axis, DirectionsConstraint::Condition::parallel, true, true};
const JointRecipe kTranslational = {"translational", Place::on_axis, DirectionsConstraint::Condition::aligned, false,
                                    true};
const JointRecipe kPlanar = {"planar", Place::in_plane, DirectionsConstraint::Condition::parallel,
                             false,    false,           "normal"};
}  // namespace

void add_cylindrical(MechanismBuilder& builder, const std::string& name,
                     const std::pair<std::string, std::string>& points, const JointAxes& axes,
                     const JointCoordinates& coordinates) {
  add_joint(builder, kCylindrical, name, points, axes, coordinates);
}

void add_translational(MechanismBuilder& builder, const std::string& name,
                       const std::pair<std::string, std::string>& points, const JointAxes& axes,
                       const std::optional<JointCoordinate>& displacement) {
  add_joint(builder, kTranslational, name, points, axes, {{}, displacement});
}

void add_planar(MechanismBuilder& builder, const std::string& name, const std::pair<std::string, std::string>& points,
                const JointAxes& normals) {
  add_joint(builder, kPlanar, name, points, normals);
}

namespace {

const std::string bodies = R"(
[gravity]
y_m_per_s2 = 1
z_m_per_s2 = -9.81

[rigid_body.sleeve]
x_m = 0
y_m = 0
z_m = 0.4
rotation_axis = [0, 0, 1]
angle_rad = 0.3
vz_m_per_s = 0.5
mass_kg = 2
inertia_xx_kg_m2 = 0.2
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.3
center_y_m = 0.1

[rigid_body.rod]
x_m = 0.6
y_m = 0
z_m = 0.4
rotation_axis = [0, 0, 1]
angle_rad = 0.3
mass_kg = 1
inertia_xx_kg_m2 = 0.05
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1

[point.A]
ground = true
x_m = 0
y_m = 0
z_m = 0

[point.bore]
on = "sleeve"
x_m = 0
y_m = 0
z_m = 0

[point.guide]
on = "sleeve"
x_m = 0.1
y_m = 0
z_m = 0

[point.tip]
on = "rod"
x_m = -0.3
y_m = 0
z_m = 0
)";

const RegisterSceneKind cylindrical({
    .name = "cylindrical",
    .phase_of = joint_phase,
    .summary = "two axes coincide: the bodies slide and turn about them; it can have both as coordinates",
    .example = bodies + R"(
[cylindrical.column]
points = ["A", "bore"]
axis_first = [0, 0.1, 1]
axis_second = [0, 0, 1]

[cylindrical.boom]
points = ["guide", "tip"]
axis_first = [1, 0, 0]
angle = "roll"
angle_rad = 0.2
displacement = "reach"
velocity_m_per_s = 0.3

[start]
given = ["sleeve.z", "sleeve.e3", "reach.displacement", "roll.angle"]
given_velocities = ["sleeve.z", "sleeve.omega_z", "reach.displacement", "rod.omega_x"]
)",
    .add = [](const std::string& name, SceneTable& table,
              MechanismBuilder& builder) { read_joint(kCylindrical, name, table, builder); },
});

const RegisterSceneKind translational({
    .name = "translational",
    .phase_of = joint_phase,
    .summary = "a slide in space: two axes coincide, no turn about them; it can have a displacement coordinate",
    .example = bodies + R"(
[translational.column]
points = ["A", "bore"]
axis_first = [0, 0, 1]
normal_first = [1, 0.1, 0]
normal_second = [1, 0, 0]

[translational.boom]
points = ["guide", "tip"]
axis_first = [1, 0.1, 0]
displacement = "reach"

[start]
given = ["sleeve.z", "reach.displacement"]
)",
    .add = [](const std::string& name, SceneTable& table,
              MechanismBuilder& builder) { read_joint(kTranslational, name, table, builder); },
});

const RegisterSceneKind planar({
    .name = "planar",
    .phase = ScenePhase::elements,
    .summary = "a planar joint in space: a point stays in a plane of another body, to which the bodies keep "
               "parallel",
    .example = bodies + R"(
[planar.floor]
points = ["A", "bore"]
normal_first = [0, 0.1, 1]
normal_second = [0, 0, 1]

[planar.table]
points = ["guide", "tip"]
normal_first = [0.2, 0, 1]

[start]
given = ["sleeve.x", "sleeve.y", "sleeve.e3", "rod.x", "rod.y", "rod.e3"]
)",
    .add = [](const std::string& name, SceneTable& table,
              MechanismBuilder& builder) { read_joint(kPlanar, name, table, builder); },
});

}  // namespace

}  // namespace costate
