#include "costate/element/kind/sliding_joint.h"

#include "costate/scene/scene_kind.h"

namespace costate {

void add_cylindrical(MechanismBuilder& builder, const std::string& name,
                     const std::pair<std::string, std::string>& points, const JointAxes& axes) {
  JointBuilder joint(builder, "cylindrical", name, points);
  joint.set_axes(axes);
  joint.keep_on_axis();
  joint.keep_directions(DirectionsConstraint::Condition::parallel);
}

void add_translational(MechanismBuilder& builder, const std::string& name,
                       const std::pair<std::string, std::string>& points, const JointAxes& axes) {
  JointBuilder joint(builder, "translational", name, points);
  joint.set_axes(axes);
  joint.keep_on_axis();
  joint.keep_directions(DirectionsConstraint::Condition::aligned);
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

void read(const std::string& name, SceneTable& table, MechanismBuilder& builder, bool translational) {
  const auto points = table.text_pair("points");
  JointAxes axes = read_axes(table);
  if (!translational) return add_cylindrical(builder, name, points, axes);
  if (table.has("normal_first")) axes.normal_first = read_direction(table, "normal_first");
  if (table.has("normal_second")) axes.normal_second = read_direction(table, "normal_second");
  add_translational(builder, name, points, axes);
}

const RegisterSceneKind cylindrical({
    .name = "cylindrical",
    .phase = ScenePhase::elements,
    .summary = "two axes coincide: the bodies slide and turn about them",
    .example = bodies + R"(
[cylindrical.column]
points = ["A", "bore"]
axis_first = [0, 0.1, 1]
axis_second = [0, 0, 1]

[cylindrical.boom]
points = ["guide", "tip"]
axis_first = [1, 0, 0]

[start]
given = ["sleeve.z", "sleeve.e3", "rod.x", "rod.e1"]
given_velocities = ["sleeve.z", "sleeve.omega_z", "rod.x", "rod.omega_x"]
)",
    .add = [](const std::string& name, SceneTable& table,
              MechanismBuilder& builder) { read(name, table, builder, false); },
});

const RegisterSceneKind translational({
    .name = "translational",
    .phase = ScenePhase::elements,
    .summary = "a slide in space: two axes coincide and the bodies do not turn about them",
    .example = bodies + R"(
[translational.column]
points = ["A", "bore"]
axis_first = [0, 0, 1]
normal_first = [1, 0.1, 0]
normal_second = [1, 0, 0]

[translational.boom]
points = ["guide", "tip"]
axis_first = [1, 0.1, 0]

[start]
given = ["sleeve.z", "rod.x"]
)",
    .add = [](const std::string& name, SceneTable& table,
              MechanismBuilder& builder) { read(name, table, builder, true); },
});

}  // namespace

}  // namespace costate
