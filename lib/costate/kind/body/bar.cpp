#include "costate/kind/body/bar.h"

#include "costate/base/error.h"
#include "costate/element/body/planar_bar.h"
#include "costate/element/constraint/distance.h"
#include "costate/kind/lookup.h"
#include "costate/mechanism/taken_number.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {

using Kind = PlanarPoint::Kind;

/// What a point on the bar depends on: the ends that move, the length, and the end on the ground.
AttachmentFrame bar_frame(const PlanarVector& ends, int length) {
  AttachmentFrame frame;
  frame.coordinates = ends.coordinates();
  frame.numbers = {length};
  frame.ends = {ends.from(), ends.to()};
  frame.kind = Kind::on_bar;
  const auto ground = [&](const PlanarPoint& end, Kind kind) {
    if (end.kind() != Kind::ground) return;
    frame.kind = kind;
    frame.numbers.insert(frame.numbers.end(), end.numbers().begin(), end.numbers().end());
  };
  ground(ends.from(), Kind::on_bar_from_ground);
  ground(ends.to(), Kind::on_bar_to_ground);
  return frame;
}

/// A bar's inertia is that of coordinates of its ends: points on bodies have none, and come later.
PlanarVector find_ends(const MechanismBuilder& builder, const std::string& path, const std::string& from,
                       const std::string& to) {
  try {
    return find_line(builder, path, from, to);
  } catch (const ModelError& e) {
    const std::string& found = e.bare_message();
    const bool unknown = found.starts_with("There is no point") && found.find("Did you mean") == std::string::npos;
    throw ModelError(e.subject(), unknown ? found +
                                                " A bar joins free points and points on the ground. What leads to a "
                                                "point on a body is a [distance] (without mass), or a [body] with a "
                                                "[revolute] at each end."
                                          : found);
  }
}

}  // namespace

void add_bar(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
             const BarOptions& o) {
  const std::string path = "bar." + name;
  const PlanarVector ends = find_ends(builder, path, from, to);
  const double distance = (builder.first_position(ends.to()) - builder.first_position(ends.from())).norm();
  const int mass = builder.add_number(path + ".mass_kg", o.mass_kg, NumberRule::non_negative);
  constexpr auto rule = NumberRule::positive;
  const std::string key = path + ".length_m";
  const int length = o.length_m ? builder.add_number(key, *o.length_m, rule)
                                : add_number_of_line(builder, key, distance, ends.from(), ends.to(), rule);
  if (o.center_m.has_value() != o.inertia_kg_m2.has_value())
    throw ModelError(path, "A bar that is not uniform needs both 'center_m' and 'inertia_kg_m2'.");
  builder.add(std::make_unique<DistanceConstraint>("bar", name, ends, length));
  builder.add_frame(name, bar_frame(ends, length));
  if (o.center_m) {
    const int center = builder.add_number(path + ".center_m", *o.center_m);
    const int inertia = builder.add_number(path + ".inertia_kg_m2", *o.inertia_kg_m2, NumberRule::non_negative);
    builder.add(std::make_unique<PlanarBar>(name, PlanarBar::Distribution::general, ends,
                                            std::vector{mass, length, center, inertia}, builder.gravity_numbers()));
  } else if (o.mass_kg > 0) {
    builder.add(std::make_unique<PlanarBar>(name, PlanarBar::Distribution::uniform, ends, std::vector{mass},
                                            builder.gravity_numbers()));
  } else {
    builder.fix_number(mass, "the bar is massless, a constraint without inertia; give it a mass to vary it");
  }
}

namespace {

void add_bar(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  const std::string from = table.text("from"), to = table.text("to");
  BarOptions o;
  o.mass_kg = table.value("mass_kg");
  o.length_m = table.find_value("length_m");
  o.center_m = table.find_value("center_m");
  o.inertia_kg_m2 = table.find_value("inertia_kg_m2");
  add_bar(builder, name, from, to, o);
}

const RegisterSceneKind bar_registered({
    .name = "bar",
    .phase = ScenePhase::bars,
    .summary = "a rigid bar between two points, with mass or a massless link",
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

[point.Q]
x_m = 1.4
y_m = -1.2

[point.R]
x_m = 2.0
y_m = -0.9

[point.B]
ground = true
x_m = 2.3
y_m = 0

[bar.uniform]
from = "A"
to = "P"
mass_kg = 2.0

[bar.general]
from = "P"
to = "Q"
mass_kg = 1.5
length_m = 0.9
center_m = 0.3
inertia_kg_m2 = 0.2

[bar.light]
from = "Q"
to = "R"
mass_kg = 0

[bar.last]
from = "R"
to = "B"
mass_kg = 0.5
center_m = 0.2
inertia_kg_m2 = 0.01

[start]
given = ["P.x", "Q.x"]
)",
    .add = add_bar,
});

}  // namespace

}  // namespace costate
