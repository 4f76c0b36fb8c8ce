#include "costate/kind/road/road.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/kind/law/law_table.h"
#include "costate/kind/law/measured_columns.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_road(MechanismBuilder& builder, const std::string& name, const RoadOptions& o) {
  const std::string path = "road." + name;
  std::vector<int> numbers;
  if (o.kind == Road::Kind::flat) {
    numbers.push_back(builder.add_number(path + ".height_m", o.height_m));
    builder.add_shared_part(path, std::make_shared<Road>(o.kind, nullptr, false, false, numbers));
    return;
  }
  if (!o.law) throw ModelError(path, "A profile or a post needs a law of its height.");
  const bool post = o.kind == Road::Kind::post, has_speed = o.speed_m_per_s != 0, has_ramp = o.ramp != 0;
  if (has_speed && !post) throw ModelError(path, "Only a post has a speed: the height of a profile is one over x.");
  if (has_speed) numbers.push_back(builder.add_number(path + ".speed_m_per_s", o.speed_m_per_s));
  if (has_ramp)
    numbers.push_back(builder.add_number(path + (post ? ".ramp_s" : ".ramp_m"), o.ramp, NumberRule::positive));
  require_units(path + ".law", o.law, "m", post ? "" : "m");
  const RegisteredLaw law = add_law(builder, path + ".law", o.law);
  numbers.insert(numbers.end(), law.numbers.begin(), law.numbers.end());
  builder.add_shared_part(path, std::make_shared<Road>(o.kind, law.law, has_speed, has_ramp, numbers));
}

std::shared_ptr<const Road> find_road(const MechanismBuilder& builder, const std::string& subject,
                                      const std::string& name) {
  auto road = std::dynamic_pointer_cast<const Road>(builder.find_shared_part("road." + name));
  if (!road) {
    const auto known = builder.shared_part_names("road");
    throw ModelError(subject, fmt::format("There is no road '{}'.{}", name,
                                          known.empty() ? " Add one: [road." + name + "] with kind = \"flat\"."
                                                        : suggestion(name, known)));
  }
  return road;
}

namespace {

void add_road(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  RoadOptions o;
  const std::string kind = table.one_of("kind", {"flat", "profile", "post"});
  if (kind == "flat") {
    o.height_m = table.value("height_m", NumberRule::any, 0);
    return add_road(builder, name, o);
  }
  o.kind = kind == "post" ? Road::Kind::post : Road::Kind::profile;
  o.law = read_law(table, "law");
  if (kind == "post") o.speed_m_per_s = table.find_value("speed_m_per_s", NumberRule::positive).value_or(0);
  o.ramp = table.find_value(kind == "post" ? "ramp_s" : "ramp_m", NumberRule::positive).value_or(0);
  add_road(builder, name, o);
}

const RegisterSceneKind road_registered({
    .name = "road",
    .phase = ScenePhase::points,
    .summary = "the ground under tyres and contacts: flat, a profile over x, or a post that moves in time",
    .example = R"(
[gravity]
z_m_per_s2 = -9.81

[road.plain]
kind = "flat"
height_m = 0.05

[road.hill]
kind = "profile"
law = { kind = "sine", amplitude = 0.08, angular_frequency_rad_per_s = 1.3, phase_rad = 0.4 }

[road.hump]
kind = "profile"
law = { kind = "bump", height_m = 0.05, start_m = -1, length_m = 3 }
ramp_m = 4.0

[road.rough]
kind = "profile"
law = { kind = "iso8608", roughness_m3 = 0.5, seed = 3, count = 21, n_min_1_per_m = 0.4, n_max_1_per_m = 0.8 }

[road.rig]
kind = "post"
law = { kind = "noise", exponent = 1.5, roughness_m3 = 0.4, seed = 5, count = 8, n_min_1_per_m = 0.4, n_max_1_per_m = 0.8 }
speed_m_per_s = 2.0
ramp_s = 0.9

[rigid_body.frame]
x_m = 0.3
y_m = 0.1
z_m = 0.6
rotation_axis = [1, -0.8, 2]
angle_rad = 0.25
vx_m_per_s = 4.0
mass_kg = 3.0
inertia_xx_kg_m2 = 0.7
inertia_yy_kg_m2 = 0.9
inertia_zz_kg_m2 = 0.8

[point.hub]
on = "frame"
x_m = 0.2
y_m = -0.3
z_m = 0.0

[point.middle]
on = "frame"
x_m = -0.2
y_m = 0.1
z_m = 0.1

[tyre.plain]
wheel = "hub"
road = "plain"
radius_m = 1.1
stiffness_N_per_m = 90
model = "ride"

[tyre.hill]
wheel = "hub"
road = "hill"
road_factor = -0.7
road_offset_m = 0.2
radius_m = 1.1
stiffness_N_per_m = 90
damping_N_s_per_m = 4
model = "ride"

[tyre.hump]
wheel = "middle"
road = "hump"
road_offset_m = -1.5
radius_m = 1.2
stiffness_N_per_m = 70
damping_N_s_per_m = 4
model = "ride"
contact = "vertical"

[tyre.rough]
wheel = "middle"
road = "rough"
radius_m = 1.2
stiffness_N_per_m = 80
model = "ride"
contact = "source"

[tyre.rig]
wheel = "hub"
road = "rig"
road_delay_s = 0.1
radius_m = 1.1
stiffness_N_per_m = 60
damping_N_s_per_m = 3
model = "ride"

[start]
given = ["frame"]
)",
    .add = add_road,
});

}  // namespace

}  // namespace costate
