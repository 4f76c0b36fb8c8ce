#include "costate/kind/joint/distance.h"

#include <type_traits>

#include "costate/element/constraint/distance.h"
#include "costate/element/constraint/spatial_distance.h"
#include "costate/kind/lookup.h"
#include "costate/mechanism/taken_number.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_distance(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
                  std::optional<double> length_m) {
  const std::string path = "distance." + name;
  const auto add_between = [&]<class Rod>(std::type_identity<Rod>, const auto& d) {
    const double first = (builder.first_position(d.to()) - builder.first_position(d.from())).norm();
    constexpr auto rule = NumberRule::positive;
    const std::string key = path + ".length_m";
    const int length = length_m ? builder.add_number(key, *length_m, rule)
                                : add_number_of_line(builder, key, first, d.from(), d.to(), rule);
    builder.add(std::make_unique<Rod>("distance", name, d, length));
  };
  if (is_spatial(builder, from, to))
    add_between(std::type_identity<SpatialDistanceConstraint>(), find_spatial_line(builder, path, from, to));
  else
    add_between(std::type_identity<DistanceConstraint>(), find_line(builder, path, from, to));
}

namespace {

const RegisterSceneKind distance_registered({
    .name = "distance",
    .phase = ScenePhase::elements,
    .summary = "a massless rod: two points of any sort keep their distance",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[body.plate]
x_m = 0.5
y_m = -1.0
angle_rad = 0.3
mass_kg = 2
inertia_kg_m2 = 0.4
center_x_m = 0.1

[point.left]
on = "plate"
x_m = -0.3
y_m = 0.1

[point.right]
on = "plate"
x_m = 0.4
y_m = 0.2

[point.P]
x_m = 1.5
y_m = -0.5

[mass.bob]
point = "P"
mass_kg = 0.5

[distance.hanger]
from = "A"
to = "left"
length_m = 1.1

[distance.link]
from = "right"
to = "P"

[start]
given = ["plate.y", "plate.angle", "P.y"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string from = table.text("from"), to = table.text("to");
          add_distance(builder, name, from, to, table.find_value("length_m"));
        },
});

}  // namespace

}  // namespace costate
