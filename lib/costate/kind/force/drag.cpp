#include "costate/kind/force/drag.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/force/drag.h"
#include "costate/kind/law/law_table.h"
#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {
constexpr const char* kWind[3] = {"wind_x_m_per_s", "wind_y_m_per_s", "wind_z_m_per_s"};

template <class Point>
void add_at(MechanismBuilder& builder, const std::string& name, const Point& point, const DragOptions& o) {
  const std::string path = "drag." + name;
  if (point.kind() == Point::Kind::ground)
    throw ModelError(path + ".point", "'" + point.name() + "' is on the ground, where a force does nothing.");
  constexpr auto rule = NumberRule::non_negative;
  std::vector<int> numbers = {
      builder.add_number(path + ".air_density_kg_per_m3", o.air_density_kg_per_m3, rule),
      builder.add_number(path + ".drag_coefficient", o.drag_coefficient, rule),
      builder.add_number(path + ".area_m2", o.area_m2, rule),
      builder.add_number(path + ".smoothing_m_per_s", o.smoothing_m_per_s, NumberRule::positive)};
  typename Drag<Point>::Wind wind;
  for (std::size_t k = 0; k < wind.size(); ++k) {
    const RegisteredLaw law = add_law(builder, path + "." + kWind[k], o.wind_m_per_s[k]);
    wind[k] = law.law;
    numbers.insert(numbers.end(), law.numbers.begin(), law.numbers.end());
  }
  builder.add(std::make_unique<Drag<Point>>(name, point, wind, numbers));
}
}  // namespace

void add_drag(MechanismBuilder& builder, const std::string& name, const std::string& point, const DragOptions& o) {
  if (builder.has_spatial_point(point)) return add_at(builder, name, builder.spatial_point(point), o);
  add_at(builder, name, find_point(builder, "drag." + name + ".point", point), o);
}

namespace {

const RegisterSceneKind drag_registered({
    .name = "drag",
    .phase = ScenePhase::elements,
    .summary = "aerodynamic drag at a point, against the wind",
    .example = R"(
[gravity]
z_m_per_s2 = -9.81

[rigid_body.car]
x_m = 0
y_m = 0.1
z_m = 1
rotation_axis = [1, 2, -1]
angle_rad = 0.4
vx_m_per_s = 8
omega_x_rad_per_s = 0.5
mass_kg = 10
inertia_xx_kg_m2 = 1.2
inertia_yy_kg_m2 = 1.5
inertia_zz_kg_m2 = 1.1

[point.front]
on = "car"
x_m = 0.5
y_m = 0
z_m = 0.1

[drag.air]
point = "front"
drag_coefficient = 0.4
area_m2 = 1.8
wind_x_m_per_s = -2
wind_y_m_per_s = { kind = "sine", mean = 0.5, amplitude = 1, angular_frequency_rad_per_s = 3 }

[point.kite]
x_m = 0.4
y_m = 2
vx_m_per_s = 3

[mass.kite]
point = "kite"
mass_kg = 0.3

[drag.kite]
point = "kite"
drag_coefficient = 1.1
area_m2 = 0.5
air_density_kg_per_m3 = 1.1
smoothing_m_per_s = 0.1
wind_x_m_per_s = 4

[start]
given = ["car", "kite.x", "kite.y"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string point = table.text("point");
          DragOptions o;
          o.drag_coefficient = table.value("drag_coefficient", NumberRule::non_negative);
          o.area_m2 = table.value("area_m2", NumberRule::non_negative);
          o.air_density_kg_per_m3 =
              table.value("air_density_kg_per_m3", NumberRule::non_negative, o.air_density_kg_per_m3);
          o.smoothing_m_per_s = table.value("smoothing_m_per_s", NumberRule::positive, o.smoothing_m_per_s);
          const std::size_t dim = builder.has_spatial_point(point) ? 3 : 2;
          for (std::size_t k = 0; k < dim; ++k) o.wind_m_per_s[k] = read_law(table, kWind[k], 0);
          add_drag(builder, name, point, o);
        },
});

}  // namespace

}  // namespace costate
