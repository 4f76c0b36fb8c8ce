#include "costate/kind/force/axis_spring.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/force/axis_force.h"
#include "costate/kind/joint/joint_axes.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_axis_spring(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
                     const std::array<double, 3>& axis, const SpringOptions& o) {
  const std::string path = "axis_spring." + name;
  if (axis[0] == 0 && axis[1] == 0 && axis[2] == 0) throw ModelError(path + ".axis", "A direction must not be zero.");
  const SpatialVector d = find_spatial_line(builder, path, from, to);
  const SpringParts parts = add_spring_parts(builder, path, o, NumberRule::any);
  std::vector<int> axis_numbers;
  for (std::size_t k = 0; k < 3; ++k)
    axis_numbers.push_back(builder.add_number(fmt::format("{}.axis[{}]", path, k), axis[k]));
  builder.add(
      std::make_unique<AxisForce<SpringDamperLaw>>("axis_spring", name, parts.law, parts.numbers, d, axis_numbers));
}

namespace {

const RegisterSceneKind axis_spring_registered({
    .name = "axis_spring",
    .phase = ScenePhase::elements,
    .summary = "a spring and damper along an axis of a body in space",
    .example = R"(
[gravity]
z_m_per_s2 = -9.81

[rigid_body.chassis]
x_m = 0
y_m = 0.1
z_m = 1
rotation_axis = [1, 2, -1]
angle_rad = 0.4
omega_x_rad_per_s = 0.5
mass_kg = 10
inertia_xx_kg_m2 = 1.2
inertia_yy_kg_m2 = 1.5
inertia_zz_kg_m2 = 1.1

[rigid_body.wheel]
x_m = 0.2
y_m = 0.8
z_m = 0.6
mass_kg = 3
inertia_xx_kg_m2 = 0.2
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.25

[natural_body.load]
x_m = -0.3
y_m = 0.5
z_m = 0.4
rotation_axis = [1, -1, 2]
angle_rad = 0.5
omega_y_rad_per_s = -0.4
mass_kg = 2
inertia_xx_kg_m2 = 0.15
inertia_yy_kg_m2 = 0.2
inertia_zz_kg_m2 = 0.3

[point.floor]
ground = true
x_m = 0
y_m = 0
z_m = 0

[point.seat]
on = "chassis"
x_m = 0.1
y_m = 0.3
z_m = -0.2

[point.ball]
on = "wheel"
x_m = -0.1
y_m = -0.1
z_m = 0.2

[point.hook]
on = "load"
x_m = 0.1
y_m = 0
z_m = 0.3

[axis_spring.leaf]
from = "seat"
to = "ball"
axis = [0.1, 0.2, 1]
stiffness_N_per_m = 400
natural_length_m = -0.1
preload_N = 5
damping_N_s_per_m = 20
spring_law = { kind = "bump_stop", gap = 0.5, stiffness = 300, exponent = 2.5, smoothing = 0.2 }

[axis_spring.tyre]
from = "floor"
to = "ball"
axis = [0, 0, 2]
stiffness_N_per_m = 900
natural_length_m = 0.8
damper_law = { kind = "polynomial", coefficients = [0, 15, 4] }

[axis_spring.rail]
from = "hook"
to = "ball"
axis = [1, -0.2, 0.3]
stiffness_N_per_m = 200
natural_length_m = 0.3
damping_N_s_per_m = 10

[start]
given = ["chassis", "wheel", "load"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string from = table.text("from"), to = table.text("to");
          const auto axis = read_direction(table, "axis");
          add_axis_spring(builder, name, from, to, axis, read_spring_options(table));
        },
});

}  // namespace

}  // namespace costate
