#include "costate/kind/joint/coupling.h"

#include <fmt/format.h>

#include <numbers>

#include "costate/base/error.h"
#include "costate/element/constraint/coupling.h"
#include "costate/kind/lookup.h"
#include "costate/mechanism/taken_number.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {
struct Coupled {
  int first, second;
  double factor, ratio;
  std::string ratio_key, offset_key, unit;
};

void couple(MechanismBuilder& builder, const std::string& kind, const std::string& name, const Coupled& c,
            std::optional<double> offset) {
  const std::string path = kind + "." + name + ".";
  if (c.ratio == 0) throw ModelError(path + c.ratio_key, "A coupling's ratio must not be zero.");
  const double found = builder.first_value(c.second) - c.factor * c.ratio * builder.first_value(c.first);
  const int ratio = builder.add_number(path + c.ratio_key, c.ratio);
  const int shift = offset ? builder.add_number(path + c.offset_key, *offset)
                           : add_taken_number(builder, path + c.offset_key, found, {c.first, c.second}, {ratio});
  builder.add(std::make_unique<CouplingConstraint>(kind, name, c.first, c.second, c.factor, ratio, shift, c.unit));
}

/// A coordinate in m.
int find_way(const MechanismBuilder& builder, const std::string& subject, const std::string& name) {
  const int way = find_coordinate(builder, subject, name);
  if (const std::string unit = builder.coordinate_unit(way); unit != "m")
    throw ModelError(subject, fmt::format("The coordinate must be a length in m; '{}' is in {}.", name, unit));
  return way;
}
}  // namespace

void add_gear(MechanismBuilder& builder, const std::string& name, const std::pair<std::string, std::string>& angles,
              double ratio, std::optional<double> offset_rad) {
  const auto q = find_angles(builder, "gear." + name, {angles.first, angles.second});
  couple(builder, "gear", name, {q[0], q[1], 1, ratio, "ratio", "offset_rad", "N m"}, offset_rad);
}

void add_rack_and_pinion(MechanismBuilder& builder, const std::string& name, const std::string& angle,
                         const std::string& coordinate, double radius_m, std::optional<double> offset_m) {
  const std::string path = "rack_and_pinion." + name;
  const int turn = find_angle(builder, path + ".angle", angle),
            way = find_way(builder, path + ".coordinate", coordinate);
  couple(builder, "rack_and_pinion", name, {turn, way, 1, radius_m, "radius_m", "offset_m", "N"}, offset_m);
}

void add_screw(MechanismBuilder& builder, const std::string& name, const std::string& angle,
               const std::string& coordinate, double lead_m_per_turn, std::optional<double> offset_m) {
  const std::string path = "screw." + name;
  const int turn = find_angle(builder, path + ".angle", angle),
            way = find_way(builder, path + ".coordinate", coordinate);
  couple(builder, "screw", name,
         {turn, way, 0.5 / std::numbers::pi, lead_m_per_turn, "lead_m_per_turn", "offset_m", "N"}, offset_m);
}

namespace {

const RegisterSceneKind gear({
    .name = "gear",
    .phase = ScenePhase::elements,
    .summary = "two angles turn in a fixed ratio",
    .example = R"(
[point.A]
ground = true
x_m = 0
y_m = 0

[point.B]
ground = true
x_m = 0.3
y_m = 0

[body.wheel]
x_m = 0
y_m = 0
angle_rad = 0.2
angular_velocity_rad_per_s = 2
mass_kg = 2
inertia_kg_m2 = 0.1

[body.pinion]
x_m = 0.3
y_m = 0
angle_rad = -0.5
mass_kg = 0.4
inertia_kg_m2 = 0.01

[point.hub]
on = "wheel"
x_m = 0
y_m = 0

[point.bore]
on = "pinion"
x_m = 0
y_m = 0

[revolute.A]
points = ["A", "hub"]

[revolute.B]
points = ["B", "bore"]

[gear.mesh]
angles = ["wheel", "pinion"]
ratio = -2.5

[torsion_spring.return]
angle = "pinion"
stiffness_N_m_per_rad = 5

[start]
given = ["wheel.angle"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const auto angles = table.text_pair("angles");
          const double ratio = table.value("ratio");
          add_gear(builder, name, angles, ratio, table.find_value("offset_rad"));
        },
});

// A rack and a nut in space, on slides and a spindle of their own.
const std::string bench = R"(
[gravity]
z_m_per_s2 = -9.81

[rigid_body.rotor]
x_m = 0
y_m = 0
z_m = 0.1
omega_y_rad_per_s = 1
mass_kg = 1
inertia_xx_kg_m2 = 0.02
inertia_yy_kg_m2 = 0.03
inertia_zz_kg_m2 = 0.02

[rigid_body.slider]
x_m = 0.3
y_m = 0
z_m = 0
mass_kg = 2
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1

[point.A]
ground = true
x_m = 0
y_m = 0
z_m = 0.1

[point.hub]
on = "rotor"
x_m = 0
y_m = 0
z_m = 0

[point.shoe]
on = "slider"
x_m = 0
y_m = 0
z_m = 0.1
)";

const RegisterSceneKind rack_and_pinion({
    .name = "rack_and_pinion",
    .phase = ScenePhase::elements,
    .summary = "a way is a radius times an angle",
    .example = bench + R"(
[hinge.pinion]
points = ["A", "hub"]
axis_first = [0, 1, 0]
angle = "pinion"

[translational.rack]
points = ["A", "shoe"]
axis_first = [1, 0, 0.3]
displacement = "rack"

[rack_and_pinion.mesh]
angle = "pinion"
coordinate = "rack.displacement"
radius_m = 0.08

[start]
given = ["pinion.angle"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string angle = table.text("angle"), coordinate = table.text("coordinate");
          const double radius = table.value("radius_m");
          add_rack_and_pinion(builder, name, angle, coordinate, radius, table.find_value("offset_m"));
        },
});

const RegisterSceneKind screw({
    .name = "screw",
    .phase = ScenePhase::elements,
    .summary = "a way is a lead times the turns of an angle",
    .example = bench + R"(
[translational.guide]
points = ["A", "shoe"]
axis_first = [1, 0, 0]

[cylindrical.spindle]
points = ["A", "hub"]
axis_first = [0, 0, 1]
angle = "spindle"
displacement = "spindle"
velocity_m_per_s = 0.2

[screw.thread]
angle = "spindle"
coordinate = "spindle.displacement"
lead_m_per_turn = 0.5

[screw.feed]
angle = "spindle"
coordinate = "slider.x"
lead_m_per_turn = -0.3

[start]
given = ["spindle.displacement"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string angle = table.text("angle"), coordinate = table.text("coordinate");
          const double lead = table.value("lead_m_per_turn");
          add_screw(builder, name, angle, coordinate, lead, table.find_value("offset_m"));
        },
});

}  // namespace

}  // namespace costate
