#include "costate/element/kind/force.h"

#include "costate/base/error.h"
#include "costate/element/force/point_force.h"
#include "costate/element/kind/lookup.h"
#include "costate/element/kind/table_options.h"
#include "costate/scene/law_table.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_force(MechanismBuilder& builder, const std::string& name, const std::string& point,
               const LawOptions& x_N, const LawOptions& y_N) {
  const std::string path = "force." + name;
  const PlanarPoint& p = find_point(builder, path + ".point", point);
  if (p.kind() == PlanarPoint::Kind::ground)
    throw ModelError(path + ".point", "'" + point + "' is on the ground, where a force does nothing.");
  const RegisteredLaw x = add_law(builder, path + ".x_N", x_N), y = add_law(builder, path + ".y_N", y_N);
  std::vector<int> numbers = x.numbers;
  numbers.insert(numbers.end(), y.numbers.begin(), y.numbers.end());
  builder.add(std::make_unique<PointForce>(name, p, x.law, y.law, numbers));
}

void add_couple(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                const LawOptions& torque_N_m) {
  const std::string path = "couple." + name;
  const std::vector<int> coordinates = find_angles(builder, path, angles);
  const RegisteredLaw torque = add_law(builder, path + ".torque_N_m", torque_N_m);
  builder.add(std::make_unique<Couple>(name, coordinates, torque.law, torque.numbers));
}

namespace {

const RegisterSceneKind force({
    .name = "force",
    .phase = ScenePhase::elements,
    .summary = "a force on a point, constant or a law of time",
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

[point.middle]
on = "arm"
x_m = 0.5
y_m = 0.1

[body.plate]
x_m = 1.5
y_m = -0.2
angle_rad = 0.3
mass_kg = 2
inertia_kg_m2 = 0.4

[point.ear]
on = "plate"
x_m = -0.3
y_m = 0.2

[force.push]
point = "P"
x_N = 3

[force.pull]
point = "middle"
x_N = 1
y_N = { kind = "table", x = [0, 0.5, 1, 2], y = [0, 2, 1, 4] }

[force.shake]
point = "ear"
x_N = { kind = "sine", mean = 0, amplitude = 4, angular_frequency_rad_per_s = 6 }
y_N = { kind = "polynomial", coefficients = [1, 2] }

[start]
given = ["P.x", "plate.x", "plate.y", "plate.angle"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string point = table.text("point");
          if (!table.has("x_N") && !table.has("y_N"))
            table.fail("needs 'x_N' or 'y_N' (a number or a law of time).");
          const LawOptions x = read_law(table, "x_N", 0), y = read_law(table, "y_N", 0);
          add_force(builder, name, point, x, y);
        },
});

const RegisterSceneKind couple({
    .name = "couple",
    .phase = ScenePhase::elements,
    .summary = "a torque on an angle or between two, constant or a law of time",
    .example = R"(
[body.wheel]
x_m = 0
y_m = 0
angle_rad = 0.1
mass_kg = 1
inertia_kg_m2 = 0.1

[body.disc]
x_m = 1.5
y_m = 0.2
angle_rad = 0.3
mass_kg = 1
inertia_kg_m2 = 0.1

[couple.drive]
angle = "wheel"
torque_N_m = 0.3

[couple.between]
angles = ["wheel", "disc"]
torque_N_m = { kind = "sine", mean = 0.1, amplitude = 1, angular_frequency_rad_per_s = 3, phase_rad = 0.4 }

[start]
given = ["wheel.x", "wheel.y", "wheel.angle", "disc.x", "disc.y", "disc.angle"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const auto angles = read_angles(table);
          add_couple(builder, name, angles, read_law(table, "torque_N_m"));
        },
});

}  // namespace

}  // namespace costate
