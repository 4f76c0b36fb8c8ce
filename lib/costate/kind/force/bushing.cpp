#include "costate/kind/force/bushing.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/force/bushing.h"
#include "costate/kind/body/rigid_body.h"
#include "costate/kind/joint/joint_axes.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_bushing(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
                 const BushingOptions& o) {
  const std::string path = "bushing." + name;
  SpatialVector d = find_spatial_line(builder, path, from, to);
  if (d.from().coordinates() == d.to().coordinates())
    throw ModelError(path + ".to", fmt::format("'{}' and '{}' are fixed to {}; a bushing joins two bodies, or a "
                                               "body and the ground.",
                                               from, to, d.size() == 0 ? "the ground" : "the same body"));
  for (const SpatialPoint* p : {&d.from(), &d.to()})
    if (!p->has_directions())
      throw ModelError(
          path + (p == &d.from() ? ".from" : ".to"),
          fmt::format("'{}' must be on a body or on the ground, in whose frame the bushing stands.", p->name()));
  std::vector<int> numbers;
  const auto add = [&](const char* key, const std::array<double, 3>& x, NumberRule rule) {
    for (std::size_t k = 0; k < 3; ++k)
      numbers.push_back(builder.add_number(fmt::format("{}.{}[{}]", path, key, k), x[k], rule));
  };
  add("stiffness_N_per_m", o.stiffness_N_per_m, NumberRule::non_negative);
  add("stiffness_N_m_per_rad", o.stiffness_N_m_per_rad, NumberRule::non_negative);
  add("damping_N_s_per_m", o.damping_N_s_per_m, NumberRule::non_negative);
  add("damping_N_m_s_per_rad", o.damping_N_m_s_per_rad, NumberRule::non_negative);
  add("preload_N", o.preload_N, NumberRule::any);
  add("preload_N_m", o.preload_N_m, NumberRule::any);
  builder.add(
      std::make_unique<Bushing>(name, std::move(d), numbers, Vector4(o.frame_from.data()), Vector4(o.frame_to.data())));
}

namespace {

std::array<double, 3> read_three(SceneTable& table, const std::string& key, NumberRule rule) {
  if (!table.has(key)) return {};
  const auto x = table.values(key, rule);
  if (x.size() != 3) table.fail(key, fmt::format("must hold x, y, z, found {} numbers.", x.size()));
  return {x[0], x[1], x[2]};
}

std::array<double, 4> read_frame(SceneTable& table, const std::string& body) {
  const std::string axis = "rotation_axis_" + body, angle = "angle_" + body + "_rad";
  if (!table.has(axis)) {
    if (table.has(angle)) table.fail(angle, "needs '" + axis + "', the axis to turn about.");
    return {1, 0, 0, 0};
  }
  const auto about = read_direction(table, axis);
  return euler_parameters(about, table.value(angle));
}

const RegisterSceneKind bushing_registered({
    .name = "bushing",
    .phase = ScenePhase::elements,
    .summary = "springs and dampers along and about three axes between two bodies in space",
    .example = R"(
[gravity]
z_m_per_s2 = -9.81

[rigid_body.frame]
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

[rigid_body.engine]
x_m = 0.2
y_m = 0.8
z_m = 0.6
rotation_axis = [0, 1, -1]
angle_rad = 0.7
mass_kg = 3
inertia_xx_kg_m2 = 0.2
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.25

[natural_body.box]
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

[point.wall]
ground = true
x_m = 0
y_m = 0.5
z_m = 0.9

[point.seat]
on = "frame"
x_m = 0.1
y_m = 0.3
z_m = -0.2

[point.foot]
on = "engine"
x_m = -0.1
y_m = -0.1
z_m = 0.2

[point.lid]
on = "box"
x_m = 0.1
y_m = 0
z_m = 0.3

[bushing.mount]
from = "seat"
to = "foot"
rotation_axis_from = [0, 0, 1]
angle_from_rad = 0.3
rotation_axis_to = [1, 0, 0]
angle_to_rad = -0.2
stiffness_N_per_m = [300, 200, 100]
stiffness_N_m_per_rad = [20, 30, 40]
damping_N_s_per_m = [3, 4, 5]
damping_N_m_s_per_rad = [0.3, 0.2, 0.1]
preload_N = [0, 0, 30]
preload_N_m = [0.1, 0, -0.2]

[bushing.tether]
from = "wall"
to = "seat"
stiffness_N_per_m = [100, 100, 100]
stiffness_N_m_per_rad = [10, 10, 15]

[bushing.rubber]
from = "lid"
to = "foot"
rotation_axis_to = [0, 1, 0]
angle_to_rad = 0.4
stiffness_N_per_m = [120, 150, 90]
stiffness_N_m_per_rad = [15, 12, 10]
damping_N_s_per_m = [2, 1, 3]
damping_N_m_s_per_rad = [0.2, 0.1, 0.3]

[bushing.stand]
from = "lid"
to = "wall"
stiffness_N_per_m = [80, 70, 60]
stiffness_N_m_per_rad = [5, 6, 7]

[start]
given = ["frame", "engine", "box"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string from = table.text("from"), to = table.text("to");
          constexpr auto rule = NumberRule::non_negative;
          BushingOptions o;
          o.stiffness_N_per_m = read_three(table, "stiffness_N_per_m", rule);
          o.stiffness_N_m_per_rad = read_three(table, "stiffness_N_m_per_rad", rule);
          o.damping_N_s_per_m = read_three(table, "damping_N_s_per_m", rule);
          o.damping_N_m_s_per_rad = read_three(table, "damping_N_m_s_per_rad", rule);
          o.preload_N = read_three(table, "preload_N", NumberRule::any);
          o.preload_N_m = read_three(table, "preload_N_m", NumberRule::any);
          o.frame_from = read_frame(table, "from");
          o.frame_to = read_frame(table, "to");
          add_bushing(builder, name, from, to, o);
        },
});

}  // namespace

}  // namespace costate
