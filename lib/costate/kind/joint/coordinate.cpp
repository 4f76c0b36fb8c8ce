#include "costate/kind/joint/coordinate.h"

#include "costate/scene/scene_kind.h"

namespace costate {

void add_own_coordinate(MechanismBuilder& builder, const std::string& name, const std::string& unit, double value,
                        double rate) {
  const std::string path = "coordinate." + name;
  const int position = builder.add_number(path + ".value", value);
  const int velocity = builder.add_number(path + ".rate", rate);
  builder.add_coordinate(name, unit, position, velocity);
}

namespace {

const RegisterSceneKind coordinate_registered({
    .name = "coordinate",
    .phase = ScenePhase::points,
    .summary = "a coordinate of its own, such as a steering rack's displacement",
    .example = R"(
[point.A]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 0.6
y_m = -0.8

[bar.arm]
from = "A"
to = "P"
mass_kg = 2

[angle.crank]
bar = "arm"

[coordinate.command]
unit = "rad"
value = -0.9
rate = 0.5

[driver.gear]
coordinates = ["crank.angle", "command"]
weights = [1, -2]
law = 0.9

[start]
given = ["command"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string unit = table.text("unit");
          add_own_coordinate(builder, name, unit, table.value("value", NumberRule::any, 0),
                             table.value("rate", NumberRule::any, 0));
        },
});

}  // namespace

}  // namespace costate
