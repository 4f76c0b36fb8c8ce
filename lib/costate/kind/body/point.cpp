#include "costate/kind/body/point.h"

#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {
std::vector<int> add_place(MechanismBuilder& builder, const std::string& path, double x_m, double y_m) {
  return {builder.add_number(path + ".x_m", x_m), builder.add_number(path + ".y_m", y_m)};
}
}  // namespace

void add_ground_point(MechanismBuilder& builder, const std::string& name, double x_m, double y_m) {
  builder.add_point({PlanarPoint::Kind::ground, name, {}, add_place(builder, "point." + name, x_m, y_m)});
}

void add_free_point(MechanismBuilder& builder, const std::string& name, const FreePointOptions& o) {
  const std::string path = "point." + name;
  const auto place = add_place(builder, path, o.x_m, o.y_m);
  const int vx = builder.add_number(path + ".vx_m_per_s", o.vx_m_per_s);
  const int vy = builder.add_number(path + ".vy_m_per_s", o.vy_m_per_s);
  const int x = builder.add_coordinate(name + ".x", "m", place[0], vx);
  const int y = builder.add_coordinate(name + ".y", "m", place[1], vy);
  builder.add_point({PlanarPoint::Kind::free, name, {x, y}, {}});
}

void add_attached_point(MechanismBuilder& builder, const std::string& name, const std::string& on, double x_m,
                        double y_m) {
  const std::string path = "point." + name;
  const AttachmentFrame& frame = find_frame(builder, path + ".on", on);
  auto numbers = add_place(builder, path, x_m, y_m);
  numbers.insert(numbers.end(), frame.numbers.begin(), frame.numbers.end());
  builder.add_point({frame.kind, name, frame.coordinates, numbers});
}

namespace {
std::vector<int> add_spatial_place(MechanismBuilder& builder, const std::string& path,
                                   const std::array<double, 3>& x_m) {
  return {builder.add_number(path + ".x_m", x_m[0]), builder.add_number(path + ".y_m", x_m[1]),
          builder.add_number(path + ".z_m", x_m[2])};
}
}  // namespace

void add_spatial_ground_point(MechanismBuilder& builder, const std::string& name, const std::array<double, 3>& x_m) {
  builder.add_point(
      SpatialPoint(SpatialPoint::Kind::ground, name, {}, add_spatial_place(builder, "point." + name, x_m)));
}

void add_spatial_point(MechanismBuilder& builder, const std::string& name, const std::string& on,
                       const std::array<double, 3>& x_m) {
  const std::string path = "point." + name;
  const bool natural = builder.has_natural_body(on);
  const auto& body = natural ? builder.natural_body_frame(on) : find_rigid_body(builder, path + ".on", on);
  const auto kind = natural ? SpatialPoint::Kind::on_natural_body : SpatialPoint::Kind::on_body;
  builder.add_point(SpatialPoint(kind, name, body, add_spatial_place(builder, path, x_m)));
}

void add_spatial_free_point(MechanismBuilder& builder, const std::string& name, const std::array<double, 3>& x_m,
                            const std::array<double, 3>& v_m_per_s) {
  const std::string path = "point." + name;
  const auto place = add_spatial_place(builder, path, x_m);
  std::vector<int> coordinates;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string axis(1, "xyz"[i]);
    const int velocity = builder.add_number(path + ".v" + axis + "_m_per_s", v_m_per_s[i]);
    coordinates.push_back(builder.add_coordinate(name + "." + axis, "m", place[i], velocity));
  }
  builder.add_point(SpatialPoint(SpatialPoint::Kind::free, name, coordinates, {}));
}

namespace {

/// A point with z_m, or on a rigid body, is a point of space.
void add_spatial(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  const std::array<double, 3> x = {table.value("x_m"), table.value("y_m"), table.value("z_m")};
  if (table.has("on")) return add_spatial_point(builder, name, table.text("on"), x);
  if (table.flag("ground", false)) return add_spatial_ground_point(builder, name, x);
  std::array<double, 3> v;
  for (std::size_t i = 0; i < 3; ++i) v[i] = table.value(std::string("v") + "xyz"[i] + "_m_per_s", NumberRule::any, 0);
  add_spatial_free_point(builder, name, x, v);
}

void add_point(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  if (table.has("ground") && table.has("on"))
    table.fail("on", "contradicts 'ground': a point is on the ground or on a body, not both.");
  const auto on_spatial_body = [&](const std::string& on) {
    return builder.has_rigid_body(on) || builder.has_natural_body(on);
  };
  if (table.has("z_m") || (table.has("on") && on_spatial_body(table.text("on"))))
    return add_spatial(name, table, builder);
  if (table.has("on"))
    return add_attached_point(builder, name, table.text("on"), table.value("x_m"), table.value("y_m"));
  const bool ground = table.flag("ground", false);
  const double x = table.value("x_m"), y = table.value("y_m");
  if (ground) return add_ground_point(builder, name, x, y);
  FreePointOptions o{x, y};
  o.vx_m_per_s = table.value("vx_m_per_s", NumberRule::any, 0);
  o.vy_m_per_s = table.value("vy_m_per_s", NumberRule::any, 0);
  add_free_point(builder, name, o);
}

const RegisterSceneKind point_registered({
    .name = "point",
    .phase = ScenePhase::points,
    .phase_of = [](const SceneTable& t) { return t.has("on") ? ScenePhase::attached_points : ScenePhase::points; },
    .summary = "a point: on the ground, free, or fixed to a body or a bar",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0.1
y_m = 0.0

[point.P]
x_m = 0.8
y_m = -0.3
vx_m_per_s = 0.2

[point.E]
x_m = 1.5
y_m = -0.9

[bar.crank]
from = "A"
to = "P"
mass_kg = 2.0

[bar.rod]
from = "P"
to = "E"
mass_kg = 1.0

[point.middle]
on = "crank"
x_m = 0.4
y_m = 0.05

[point.tip]
on = "rod"
x_m = 1.0
y_m = -0.1

[spring.S]
from = "middle"
to = "tip"
stiffness_N_per_m = 50
natural_length_m = 0.5

[start]
given = ["P.x", "E.x"]
)",
    .add = add_point,
});

}  // namespace

}  // namespace costate
