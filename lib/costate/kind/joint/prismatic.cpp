#include "costate/kind/joint/prismatic.h"

#include "costate/element/constraint/prismatic.h"
#include "costate/kind/joint/joint_axes.h"
#include "costate/kind/lookup.h"
#include "costate/mechanism/taken_number.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_prismatic(MechanismBuilder& builder, const std::string& name,
                   const std::pair<std::string, std::string>& points, const PrismaticOptions& o) {
  const std::string path = "prismatic." + name;
  const PlanarVector d = find_pair(builder, path, "points", points);
  const auto angle = [&](const PlanarPoint& p) {
    return p.kind() == PlanarPoint::Kind::on_body ? builder.first_value(p.coordinates()[2]) : 0.0;
  };
  const int axis = builder.add_number(path + ".axis_angle_rad", o.axis_angle_rad);
  const std::string key = path + ".relative_angle_rad";
  std::vector<int> turning;
  for (const auto& p : {d.from(), d.to()})
    if (p.kind() == PlanarPoint::Kind::on_body) turning.push_back(p.coordinates()[2]);
  const int relative = o.relative_angle_rad
                           ? builder.add_number(key, *o.relative_angle_rad)
                           : add_taken_number(builder, key, angle(d.to()) - angle(d.from()), turning, {});
  builder.add(std::make_unique<PrismaticConstraint>("prismatic", name, d, axis, relative));
}

namespace {

/// Between points of space it is a translational joint.
const JointRecipe kSpatial = {"prismatic", JointRecipe::Place::on_axis, DirectionsConstraint::Condition::aligned, false,
                              true};

const RegisterSceneKind prismatic_registered({
    .name = "prismatic",
    .phase_of = joint_phase,
    .summary = "a sliding joint between two bodies, or a body and the ground; its force (across the axis, to its left) "
               "and torque are those on the first",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0.5

[body.carriage]
x_m = 0.4
y_m = 0.6
angle_rad = 0.1
mass_kg = 2
inertia_kg_m2 = 0.4

[body.tool]
x_m = 0.9
y_m = 0.9
angle_rad = 0.6
vx_m_per_s = 0.3
mass_kg = 1
inertia_kg_m2 = 0.1
center_x_m = 0.1

[point.shoe]
on = "carriage"
x_m = 0.1
y_m = 0.05

[point.guide]
on = "carriage"
x_m = 0.2
y_m = 0.1

[point.pad]
on = "tool"
x_m = -0.1
y_m = 0.02

[prismatic.rail]
points = ["A", "shoe"]
axis_angle_rad = 0.2

[prismatic.arm]
points = ["guide", "pad"]
axis_angle_rad = 0.8
relative_angle_rad = 0.5

[spring.return]
from = "A"
to = "shoe"
stiffness_N_per_m = 80
natural_length_m = 0.3

[start]
given = ["carriage.x", "tool.x"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const auto points = table.text_pair("points");
          if (is_spatial(builder, points.first, points.second)) return read_joint(kSpatial, name, table, builder);
          PrismaticOptions o;
          o.axis_angle_rad = table.value("axis_angle_rad");
          o.relative_angle_rad = table.find_value("relative_angle_rad");
          add_prismatic(builder, name, points, o);
        },
});

}  // namespace

}  // namespace costate
