#include "costate/kind/joint/tie_rod.h"

#include "costate/element/constraint/tie_rod.h"
#include "costate/kind/joint/joint_axes.h"
#include "costate/kind/lookup.h"
#include "costate/mechanism/taken_number.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_tie_rod(MechanismBuilder& builder, const std::string& name, const TieRodOptions& o) {
  const std::string path = "tie_rod." + name;
  const SpatialVector d = find_spatial_line(builder, path, o.from, o.to);
  const int slide = find_coordinate(builder, path + ".slide", o.slide);
  const double first = (builder.first_position(d.to()) - builder.first_position(d.from())).norm();
  constexpr auto rule = NumberRule::positive;
  const std::string key = path + ".length_m";
  const int length = o.length_m ? builder.add_number(key, *o.length_m, rule)
                                : add_number_of_line(builder, key, first, d.from(), d.to(), rule);
  builder.add(std::make_unique<TieRodConstraint>(name, d.from(), slide, d.to(), length, Vector3(o.direction.data())));
}

namespace {

const RegisterSceneKind tie_rod_registered({
    .name = "tie_rod",
    .phase = ScenePhase::elements,
    .summary = "a massless rod to a point that slides in a body: a steering rack's tie rod",
    .example = R"(
[gravity]
y_m_per_s2 = 2
z_m_per_s2 = -9.81

[rigid_body.frame]
x_m = 0.1
y_m = 0.2
z_m = 0.4
rotation_axis = [0, 1, 0.5]
angle_rad = 0.3
omega_z_rad_per_s = 0.4
mass_kg = 2
inertia_xx_kg_m2 = 0.2
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.3

[rigid_body.knuckle]
x_m = 0.6
y_m = 0.1
z_m = 0.7
vx_m_per_s = 0.3
mass_kg = 1
inertia_xx_kg_m2 = 0.05
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1
center_x_m = 0.05

[coordinate.rack]
unit = "m"

[point.O]
ground = true
x_m = 0.7
y_m = 0.1
z_m = 1.5

[point.rack_end]
on = "frame"
x_m = 0.2
y_m = 0.1
z_m = 0.05

[point.arm]
on = "knuckle"
x_m = -0.1
y_m = 0.05
z_m = -0.2

[point.ear]
on = "knuckle"
x_m = 0.1
y_m = 0.05
z_m = 0.1

[tie_rod.left]
from = "rack_end"
to = "arm"
slide = "rack"
direction = [0, 2, 0.5]

[tie_rod.hanger]
from = "O"
to = "ear"
slide = "rack"
direction = [1, 0, 0]
length_m = 0.75

[driver.steer]
coordinate = "rack"
law = { kind = "sine", amplitude = 0.05, angular_frequency_rad_per_s = 4 }

[start]
given = ["frame", "knuckle.y", "knuckle.e1", "knuckle.e2", "knuckle.e3"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          TieRodOptions o;
          o.from = table.text("from");
          o.to = table.text("to");
          o.slide = table.text("slide");
          o.direction = read_direction(table, "direction");
          o.length_m = table.find_value("length_m", NumberRule::positive);
          add_tie_rod(builder, name, o);
        },
});

}  // namespace

}  // namespace costate
