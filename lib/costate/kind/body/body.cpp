#include "costate/kind/body/body.h"

#include "costate/element/body/planar_body.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_body(MechanismBuilder& builder, const std::string& name, const BodyOptions& o) {
  const std::string path = "body." + name + ".";
  const auto number = [&](const char* key, double value, NumberRule rule = NumberRule::any) {
    return builder.add_number(path + key, value, rule);
  };
  std::vector<int> numbers = {number("mass_kg", o.mass_kg, NumberRule::non_negative),
                              number("inertia_kg_m2", o.inertia_kg_m2, NumberRule::non_negative),
                              number("center_x_m", o.center_x_m), number("center_y_m", o.center_y_m)};
  for (const int g : builder.gravity_numbers()) numbers.push_back(g);
  const int x = number("x_m", o.x_m), y = number("y_m", o.y_m), angle = number("angle_rad", o.angle_rad);
  const int vx = number("vx_m_per_s", o.vx_m_per_s), vy = number("vy_m_per_s", o.vy_m_per_s);
  const int w = number("angular_velocity_rad_per_s", o.angular_velocity_rad_per_s);
  const std::vector<int> q = {builder.add_coordinate(name + ".x", "m", x, vx),
                              builder.add_coordinate(name + ".y", "m", y, vy),
                              builder.add_coordinate(name + ".angle", "rad", angle, w)};
  builder.add_angle(name, q[2]);
  builder.add_frame(name, {PlanarPoint::Kind::on_body, q, {}, {}});
  builder.add(std::make_unique<PlanarBody>("body", name, q, numbers));
}

namespace {

void add_body(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  BodyOptions o;
  o.mass_kg = table.value("mass_kg");
  o.inertia_kg_m2 = table.value("inertia_kg_m2");
  o.center_x_m = table.value("center_x_m", NumberRule::any, 0);
  o.center_y_m = table.value("center_y_m", NumberRule::any, 0);
  o.x_m = table.value("x_m");
  o.y_m = table.value("y_m");
  o.angle_rad = table.value("angle_rad", NumberRule::any, 0);
  o.vx_m_per_s = table.value("vx_m_per_s", NumberRule::any, 0);
  o.vy_m_per_s = table.value("vy_m_per_s", NumberRule::any, 0);
  o.angular_velocity_rad_per_s = table.value("angular_velocity_rad_per_s", NumberRule::any, 0);
  add_body(builder, name, o);
}

const RegisterSceneKind body_registered({
    .name = "body",
    .phase = ScenePhase::points,
    .summary = "a rigid body of the plane",
    .example = R"(
[gravity]
x_m_per_s2 = 0.3
y_m_per_s2 = -9.81

[body.plate]
x_m = 0.2
y_m = 1.0
angle_rad = 0.4
vx_m_per_s = 0.5
angular_velocity_rad_per_s = 2.0
mass_kg = 3.0
inertia_kg_m2 = 0.7
center_x_m = 0.1
center_y_m = -0.05

[start]
given = ["plate.x", "plate.y", "plate.angle"]
)",
    .add = add_body,
});

}  // namespace

}  // namespace costate
