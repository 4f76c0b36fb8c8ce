#include "costate/kind/joint/path_driver.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/force/path_driver.h"
#include "costate/kind/law/law_table.h"
#include "costate/kind/law/measured_columns.h"
#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_path_driver(MechanismBuilder& builder, const std::string& name, const PathDriverOptions& o) {
  const std::string path = "path_driver." + name;
  if (!builder.has_spatial_point(o.point))
    throw ModelError(path + ".point", fmt::format("There is no point of space '{}'.", o.point));
  const SpatialPoint& point = builder.spatial_point(o.point);
  if (point.kind() != SpatialPoint::Kind::on_body)
    throw ModelError(path + ".point", "A driver sits in a vehicle: the point must be on a rigid body.");
  const int coordinate = find_coordinate(builder, path + ".coordinate", o.coordinate);
  const auto number = [&](const char* key, double value, NumberRule rule = NumberRule::any) {
    return builder.add_number(path + "." + key, value, rule);
  };
  const std::vector<int> own = {number("gain", o.gain),
                                number("yaw_gain_m_s_per_rad", o.yaw_gain_m_s_per_rad),
                                number("preview_m", o.preview_m, NumberRule::non_negative),
                                number("decision_lag_s", o.decision_lag_s, NumberRule::positive),
                                number("arm_lag_s", o.arm_lag_s, NumberRule::positive),
                                number("stiffness_N_per_m", o.stiffness_N_per_m, NumberRule::non_negative),
                                number("damping_N_s_per_m", o.damping_N_s_per_m, NumberRule::non_negative),
                                number("initial_command_m", o.initial_command_m),
                                number("initial_steering_m", o.initial_steering_m)};
  require_units(path + ".path", o.path, "m", "m");
  const RegisteredLaw law = add_law(builder, path + ".path", o.path);
  builder.add(std::make_unique<PathDriver>(name, point, coordinate, law.law, own, law.numbers));
}

namespace {

const RegisterSceneKind path_driver_registered({
    .name = "path_driver",
    .phase = ScenePhase::elements,
    .summary = "a driver who steers a vehicle along a path, by preview",
    .example = R"(
[gravity]
z_m_per_s2 = -9.81

[rigid_body.sledge]
x_m = 0.2
y_m = -0.1
z_m = 0.5
rotation_axis = [0.1, -0.2, 1]
angle_rad = 0.8
vx_m_per_s = 3
vy_m_per_s = 4
omega_global_z_rad_per_s = 0.3
mass_kg = 30.0
inertia_xx_kg_m2 = 4
inertia_yy_kg_m2 = 5
inertia_zz_kg_m2 = 6

[rigid_body.rudder]
x_m = -1
y_m = 0
z_m = 0.5
mass_kg = 3.0
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.2
inertia_zz_kg_m2 = 0.2

[point.seat]
on = "sledge"
x_m = 0.1
y_m = 0.2
z_m = 0.3

[path_driver.pilot]
point = "seat"
coordinate = "rudder.y"
path = { kind = "smooth_step", from = 1, to = 9, before = 0, after = 3.5 }
gain = 0.05
yaw_gain_m_s_per_rad = 0.02
preview_m = 4
decision_lag_s = 0.2
arm_lag_s = 0.1
stiffness_N_per_m = 300
damping_N_s_per_m = 20
initial_command_m = 0.1

[start]
given = ["sledge", "rudder"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          PathDriverOptions o;
          o.point = table.text("point");
          o.coordinate = table.text("coordinate");
          o.path = read_law(table, "path");
          o.gain = table.value("gain");
          o.yaw_gain_m_s_per_rad = table.value("yaw_gain_m_s_per_rad", NumberRule::any, 0);
          o.preview_m = table.value("preview_m", NumberRule::non_negative);
          o.decision_lag_s = table.value("decision_lag_s", NumberRule::positive);
          o.arm_lag_s = table.value("arm_lag_s", NumberRule::positive);
          o.stiffness_N_per_m = table.value("stiffness_N_per_m", NumberRule::non_negative);
          o.damping_N_s_per_m = table.value("damping_N_s_per_m", NumberRule::non_negative);
          o.initial_command_m = table.value("initial_command_m", NumberRule::any, 0);
          o.initial_steering_m = table.value("initial_steering_m", NumberRule::any, 0);
          add_path_driver(builder, name, o);
        },
});

}  // namespace

}  // namespace costate
