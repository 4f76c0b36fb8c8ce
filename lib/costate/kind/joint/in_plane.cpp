#include "costate/kind/joint/in_plane.h"

#include <fmt/format.h>

#include "costate/element/constraint/offset.h"
#include "costate/kind/joint/joint_axes.h"
#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_in_plane(MechanismBuilder& builder, const std::string& name, const std::pair<std::string, std::string>& points,
                  const std::array<double, 3>& normal) {
  const std::string path = "in_plane." + name;
  SpatialVector d = find_spatial_pair(builder, path, "points", points);
  std::vector<int> numbers;
  for (std::size_t i = 0; i < 3; ++i)
    numbers.push_back(builder.add_number(fmt::format("{}.normal[{}]", path, i), normal[i]));
  builder.add(std::make_unique<OffsetConstraint>("in_plane", name, std::move(d), numbers, std::nullopt));
}

namespace {

const RegisterSceneKind in_plane_registered({
    .name = "in_plane",
    .phase = ScenePhase::elements,
    .summary = "a point of one body stays in a plane of another",
    .example = R"(
[gravity]
y_m_per_s2 = 1
z_m_per_s2 = -9.81

[rigid_body.tray]
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

[rigid_body.puck]
x_m = 0.6
y_m = 0.1
z_m = 0.7
vx_m_per_s = 0.3
mass_kg = 1
inertia_xx_kg_m2 = 0.05
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1
center_x_m = 0.05

[point.O]
ground = true
x_m = 0
y_m = 0
z_m = 0.3

[point.corner]
on = "tray"
x_m = 0.2
y_m = 0.1
z_m = 0.05

[point.tip]
on = "puck"
x_m = -0.1
y_m = 0.05
z_m = -0.2

[in_plane.floor]
points = ["O", "corner"]
normal = [0, 0.2, 1]

[in_plane.slide]
points = ["corner", "tip"]
normal = [0.1, 0, 2]

[start]
given = ["tray.x", "tray.y", "tray.e1", "tray.e2", "tray.e3", "puck.x", "puck.y", "puck.e1", "puck.e2", "puck.e3"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const auto points = table.text_pair("points");
          add_in_plane(builder, name, points, read_direction(table, "normal"));
        },
});

}  // namespace

}  // namespace costate
