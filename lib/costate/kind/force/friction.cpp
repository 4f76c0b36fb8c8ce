#include "costate/kind/force/friction.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/force/angular_force.h"
#include "costate/element/force/axis_force.h"
#include "costate/element/force/friction_law.h"
#include "costate/element/force/planar_axis_force.h"
#include "costate/kind/force/axial_line.h"
#include "costate/kind/joint/joint_axes.h"
#include "costate/kind/law/table_options.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {

int normal_force(MechanismBuilder& builder, const std::string& path, const FrictionOptions& o) {
  const std::string key = path + ".normal_force_N";
  if (o.normal_force_number.empty()) return builder.add_number(key, o.normal_force_N, NumberRule::non_negative);
  if (!builder.has_number(o.normal_force_number))
    throw ModelError(key, fmt::format("There is no number '{}' of an element that stands before this one; expected "
                                      "a path such as spring.clamp.preload_N.",
                                      o.normal_force_number));
  const int number = builder.number(o.normal_force_number);
  if (builder.number_value(number) < 0)
    throw ModelError(key, fmt::format("A normal force must not be negative, but '{}' is {}.", o.normal_force_number,
                                      builder.number_value(number)));
  return number;
}

/// The law's numbers; radius 0: of a length.
std::vector<int> add_law_numbers(MechanismBuilder& builder, const std::string& path, const FrictionOptions& o,
                                 double radius_m = 0) {
  constexpr auto rule = NumberRule::non_negative;
  const auto add = [&](const char* key, double value, NumberRule r) {
    return builder.add_number(path + "." + key, value, r);
  };
  if (o.static_coefficient < o.dynamic_coefficient.value_or(o.static_coefficient))
    throw ModelError(path + ".static_coefficient",
                     fmt::format("The static coefficient of friction must not be less than the dynamic one, found {} "
                                 "and {}.",
                                 o.static_coefficient, *o.dynamic_coefficient));
  const int sticking = add("static_coefficient", o.static_coefficient, rule);
  std::vector<int> r = {normal_force(builder, path, o), sticking,
                        o.dynamic_coefficient ? add("dynamic_coefficient", *o.dynamic_coefficient, rule) : sticking,
                        add("transition_velocity_m_per_s", o.transition_velocity_m_per_s, NumberRule::positive),
                        add("viscous_N_s_per_m", o.viscous_N_s_per_m, rule)};
  if (radius_m > 0) {
    r.push_back(add("radius_m", radius_m, NumberRule::positive));
  } else {
    r.push_back(add("unit_radius", 1, NumberRule::any));
    builder.fix_number(r.back(), "friction along a length has no radius.");
  }
  return r;
}

std::string title(const std::string& name) { return "friction." + name; }

using Turning = AngularForce<FrictionLaw>;

void add_turning(MechanismBuilder& builder, const std::string& name, const std::vector<int>& coordinates,
                 const FrictionOptions& o, double radius_m) {
  const auto numbers = add_law_numbers(builder, title(name), o, radius_m);
  builder.add(std::make_unique<Turning>("friction", name, FrictionLaw(), numbers, coordinates,
                                        radius_m > 0 ? Turning::Measures::angle : Turning::Measures::length));
}

}  // namespace

void add_coordinate_friction(MechanismBuilder& builder, const std::string& name,
                             const std::vector<std::string>& coordinates, const FrictionOptions& o, double radius_m) {
  const std::string path = title(name);
  if (coordinates.empty() || coordinates.size() > 2)
    throw ModelError(path + ".coordinates",
                     fmt::format("One coordinate or two are needed, found {}.", coordinates.size()));
  std::vector<int> indices;
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    const std::string subject = path + (coordinates.size() == 1 ? ".coordinate" : fmt::format(".coordinates[{}]", i));
    indices.push_back(find_coordinate(builder, subject, coordinates[i]));
    const std::string unit = builder.coordinate_unit(indices.back());
    if (unit != (radius_m > 0 ? "rad" : "m"))
      throw ModelError(
          subject,
          unit == "rad"
              ? fmt::format("'{}' is an angle: give 'radius_m', at which surfaces slide.", coordinates[i])
              : fmt::format("'{}' is measured in {}; friction {} acts on coordinates in {}.", coordinates[i], unit,
                            radius_m > 0 ? "with a radius" : "without radius", radius_m > 0 ? "rad" : "m"));
  }
  if (indices.size() == 2 && indices[0] == indices[1])
    throw ModelError(path + ".coordinates[1]", "The two coordinates must differ, both are '" + coordinates[0] + "'.");
  add_turning(builder, name, indices, o, radius_m);
}

void add_angle_friction(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                        const FrictionOptions& o, double radius_m) {
  if (!(radius_m > 0))
    throw ModelError(title(name) + ".radius_m", "Friction on an angle needs the radius at which surfaces slide.");
  add_turning(builder, name, find_angles(builder, title(name), angles), o, radius_m);
}

void add_distance_friction(MechanismBuilder& builder, const std::string& name, const std::string& from,
                           const std::string& to, const FrictionOptions& o) {
  const auto numbers = add_law_numbers(builder, title(name), o);
  add_axial_force(builder, "friction", name, FrictionLaw(), numbers, from, to);
}

void add_axis_friction(MechanismBuilder& builder, const std::string& name, const std::string& from,
                       const std::string& to, const std::array<double, 3>& axis, const FrictionOptions& o) {
  const std::string path = title(name);
  if (axis[0] == 0 && axis[1] == 0 && axis[2] == 0) throw ModelError(path + ".axis", "A direction must not be zero.");
  const SpatialVector d = find_spatial_line(builder, path, from, to);
  const auto numbers = add_law_numbers(builder, path, o);
  std::vector<int> axis_numbers;
  for (std::size_t k = 0; k < 3; ++k)
    axis_numbers.push_back(builder.add_number(fmt::format("{}.axis[{}]", path, k), axis[k]));
  builder.add(std::make_unique<AxisForce<FrictionLaw>>("friction", name, FrictionLaw(), numbers, d, axis_numbers));
}

void add_planar_axis_friction(MechanismBuilder& builder, const std::string& name, const std::string& from,
                              const std::string& to, double axis_angle_rad, const FrictionOptions& o) {
  const std::string path = title(name);
  PlanarVector d = find_line(builder, path, from, to);
  const auto kind = d.from().kind();
  if (kind != PlanarPoint::Kind::on_body && kind != PlanarPoint::Kind::ground)
    throw ModelError(path + ".from",
                     "'" + from + "' must be on a body or on the ground, in whose frame the axis stands.");
  const auto numbers = add_law_numbers(builder, path, o);
  const int axis = builder.add_number(path + ".axis_angle_rad", axis_angle_rad);
  builder.add(
      std::make_unique<PlanarAxisForce<FrictionLaw>>("friction", name, FrictionLaw(), numbers, axis, std::move(d)));
}

namespace {

void add_friction(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  constexpr auto rule = NumberRule::non_negative;
  FrictionOptions o;
  if (table.is_text("normal_force_N")) {
    o.normal_force_number = table.text("normal_force_N");
    if (o.normal_force_number.empty())
      table.fail("normal_force_N",
                 "must be a number, or the path of one such as \"spring.clamp.preload_N\", found \"\".");
  } else {
    o.normal_force_N = table.value("normal_force_N", rule);
  }
  o.static_coefficient = table.value("static_coefficient", rule);
  o.dynamic_coefficient = table.find_value("dynamic_coefficient", rule);
  o.transition_velocity_m_per_s = table.value("transition_velocity_m_per_s", NumberRule::positive);
  o.viscous_N_s_per_m = table.value("viscous_N_s_per_m", rule, 0);
  const auto radius = [&] { return table.find_value("radius_m", NumberRule::positive).value_or(0); };
  if (table.has("angle") || table.has("angles"))
    return add_angle_friction(builder, name, read_angles(table), o, radius());
  if (table.has("coordinates")) return add_coordinate_friction(builder, name, table.texts("coordinates"), o, radius());
  if (table.has("coordinate")) return add_coordinate_friction(builder, name, {table.text("coordinate")}, o, radius());
  if (!table.has("from"))
    table.fail(
        "needs what it acts on: 'coordinate' or 'coordinates', 'angle' or 'angles', or 'from' and 'to' with "
        "or "
        "without an 'axis' (in the plane 'axis_angle_rad').");
  const std::string from = table.text("from"), to = table.text("to");
  if (table.has("axis")) return add_axis_friction(builder, name, from, to, read_direction(table, "axis"), o);
  if (const auto axis = table.find_value("axis_angle_rad"))
    return add_planar_axis_friction(builder, name, from, to, *axis, o);
  add_distance_friction(builder, name, from, to, o);
}

const RegisterSceneKind friction_registered({
    .name = "friction",
    .phase = ScenePhase::elements,
    .summary = "smooth Brown-McPhee friction on a coordinate, an angle, a distance or along an axis",
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
vx_m_per_s = 0.4

[mass.bob]
point = "P"
mass_kg = 1.5

[body.carriage]
x_m = 0.4
y_m = 0.6
angle_rad = 0.1
mass_kg = 2
inertia_kg_m2 = 0.4

[body.disc]
x_m = 1.5
y_m = 0.2
angle_rad = 0.3
mass_kg = 1
inertia_kg_m2 = 0.1

[point.guide]
on = "carriage"
x_m = 0.2
y_m = 0.1

[point.rim]
on = "disc"
x_m = 0.2
y_m = 0.1

[rigid_body.slide]
x_m = 0.2
y_m = 1.0
z_m = -0.5
rotation_axis = [1, 2, -1]
angle_rad = 0.4
mass_kg = 3.0
inertia_xx_kg_m2 = 0.7
inertia_yy_kg_m2 = 0.9
inertia_zz_kg_m2 = 0.5

[point.rail]
ground = true
x_m = 0
y_m = 0.9
z_m = -0.5

[point.shoe]
on = "slide"
x_m = 0.1
y_m = 0.05
z_m = 0.2

[spring.clamp]
from = "A"
to = "P"
stiffness_N_per_m = 20
natural_length_m = 0.9
preload_N = 8

[friction.floor]
coordinate = "P.x"
normal_force_N = 10
static_coefficient = 0.4
dynamic_coefficient = 0.3
transition_velocity_m_per_s = 0.5

[friction.between]
coordinates = ["P.y", "disc.y"]
normal_force_N = "spring.clamp.preload_N"
static_coefficient = 0.5
dynamic_coefficient = 0.3
transition_velocity_m_per_s = 0.4
viscous_N_s_per_m = 0.2

[friction.bearing]
angles = ["carriage", "disc"]
radius_m = 0.1
normal_force_N = 20
static_coefficient = 0.2
dynamic_coefficient = 0.1
transition_velocity_m_per_s = 0.5

[friction.rod]
from = "A"
to = "rim"
normal_force_N = 5
static_coefficient = 0.3
transition_velocity_m_per_s = 0.6

[friction.way]
from = "guide"
to = "P"
axis_angle_rad = 0.3
normal_force_N = 5
static_coefficient = 0.3
dynamic_coefficient = 0.2
transition_velocity_m_per_s = 0.6

[friction.slider]
from = "shoe"
to = "rail"
axis = [0, 1, 1]
normal_force_N = 6
static_coefficient = 0.3
dynamic_coefficient = 0.2
transition_velocity_m_per_s = 0.7

[start]
given = ["P.x", "P.y", "carriage.x", "carriage.y", "carriage.angle", "disc.x", "disc.y", "disc.angle", "slide"]
)",
    .add = add_friction,
});

}  // namespace

}  // namespace costate
