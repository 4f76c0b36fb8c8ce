#include "costate/kind/joint/driver.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/element/constraint/coordinate_driver.h"
#include "costate/element/constraint/distance_driver.h"
#include "costate/kind/law/law_table.h"
#include "costate/kind/law/measured_columns.h"
#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_driver(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& coordinates,
                const std::vector<double>& weights, const LawOptions& law) {
  const std::string path = "driver." + name;
  const bool single = weights.empty() && coordinates.size() == 1;
  if (coordinates.empty()) throw ModelError(path, "A driver needs at least one coordinate.");
  if (coordinates.size() > static_cast<std::size_t>(kMaxLocal))
    throw ModelError(path + ".coordinates",
                     fmt::format("A driver takes at most {} coordinates, found {}.", kMaxLocal, coordinates.size()));
  if (!single && weights.size() != coordinates.size())
    throw ModelError(path + ".weights", fmt::format("There must be one weight a coordinate, found {} for {}.",
                                                    weights.size(), coordinates.size()));
  std::vector<int> q, w;
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    const std::string key = single ? ".coordinate" : fmt::format(".coordinates[{}]", i);
    q.push_back(find_coordinate(builder, path + key, coordinates[i]));
    w.push_back(builder.add_number(fmt::format("{}.weights[{}]", path, i), single ? 1 : weights[i]));
  }
  for (std::size_t i = 0; i < q.size(); ++i)
    if (std::count(q.begin(), q.begin() + static_cast<std::ptrdiff_t>(i), q[i]) > 0)
      throw ModelError(fmt::format("{}.coordinates[{}]", path, i),
                       fmt::format("'{}' is listed twice; give it one weight, the sum.", coordinates[i]));
  if (!single && std::all_of(weights.begin(), weights.end(), [](double x) { return x == 0; }))
    throw ModelError(path + ".weights", "All weights are zero, and the driver moves nothing.");
  if (single)
    builder.fix_number(w[0], "a driver of one coordinate has weight 1; write coordinates and weights instead");
  const RegisteredLaw f = add_law(builder, path + ".law", law);
  const auto same = [&](int c) { return builder.coordinate_unit(c) == builder.coordinate_unit(q[0]); };
  const std::string unit = std::all_of(q.begin(), q.end(), same) ? builder.coordinate_unit(q[0]) : "";
  // A sum of coordinates has the unit of its weights, too.
  require_units(path + ".law", law, single ? unit : "", "s");
  auto driver = std::make_unique<CoordinateDriver>("driver", name, q, w, f.law, f.numbers);
  if (!unit.empty()) driver->set_unit(unit);
  builder.add(std::move(driver));
}

void add_distance_driver(MechanismBuilder& builder, const std::string& name, const std::string& from,
                         const std::string& to, const LawOptions& length_m) {
  const std::string path = "distance_driver." + name;
  const auto add_between = [&]<class Line>(const Line& d) {
    const RegisteredLaw f = add_law(builder, path + ".length_m", length_m);
    builder.add(std::make_unique<DistanceDriver<Line>>("distance_driver", name, d, f.law, f.numbers));
  };
  if (is_spatial(builder, from, to))
    add_between(find_spatial_line(builder, path, from, to));
  else
    add_between(find_line(builder, path, from, to));
}

namespace {

/// The rate of a force state, which work is, cannot depend on multipliers.
void refuse_work(SceneTable& table, const std::string& name) {
  if (table.has("work"))
    table.fail("work", fmt::format("is not integrated for drivers, whose power depends on the multipliers. A running "
                                   "cost of kind \"value\" of '{}.power' is their work.",
                                   name));
}

void add_driver(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  refuse_work(table, name);
  std::vector<std::string> coordinates;
  std::vector<double> weights;
  if (table.has("coordinates")) {
    if (table.has("coordinate")) table.fail("coordinate", "contradicts 'coordinates': give one of them.");
    coordinates = table.texts("coordinates");
    weights = table.values("weights");
  } else {
    coordinates = {table.text("coordinate")};
  }
  add_driver(builder, name, coordinates, weights, read_law(table, "law"));
}

const RegisterSceneKind driver({
    .name = "driver",
    .phase = ScenePhase::elements,
    .summary = "a coordinate, or a weighted sum of coordinates, follows a law of time; a gear",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

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

[body.disc]
x_m = 1.5
y_m = 0.2
angle_rad = 0.3
mass_kg = 1
inertia_kg_m2 = 0.1

[driver.motor]
coordinate = "crank.angle"
law = { kind = "sine", mean = -0.9, amplitude = 0.5, angular_frequency_rad_per_s = 4, phase_rad = 0.1 }

[driver.gear]
coordinates = ["crank.angle", "disc.angle"]
weights = [2, -1]
law = -2.0

[driver.lift]
coordinate = "disc.y"
law = { kind = "smooth_step", from = 0.5, to = 1.5, before = 0.2, after = 0.6 }

[start]
given = ["disc.x"]
)",
    .add = add_driver,
});

const RegisterSceneKind distance_driver({
    .name = "distance_driver",
    .phase = ScenePhase::elements,
    .summary = "the distance between two points follows a law of time",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[body.boom]
x_m = 0.9
y_m = 0.5
angle_rad = 0.4
mass_kg = 3
inertia_kg_m2 = 0.5

[point.heel]
on = "boom"
x_m = -1.0
y_m = 0.0

[point.lug]
on = "boom"
x_m = -0.2
y_m = 0.1

[point.base]
ground = true
x_m = 0.7
y_m = -0.6

[revolute.pin]
points = ["A", "heel"]

[distance_driver.ram]
from = "base"
to = "lug"
length_m = { kind = "polynomial", coefficients = [0.9, 0.2, 0.1] }

[start]
given = []
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          refuse_work(table, name);
          const std::string from = table.text("from"), to = table.text("to");
          add_distance_driver(builder, name, from, to, read_law(table, "length_m"));
        },
});

}  // namespace

}  // namespace costate
