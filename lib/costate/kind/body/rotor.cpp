#include "costate/kind/body/rotor.h"

#include "costate/element/body/rotor.h"
#include "costate/kind/joint/joint_axes.h"
#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_rotor(MechanismBuilder& builder, const std::string& name, const std::string& on, const RotorOptions& o) {
  const std::string path = "rotor." + name;
  const auto& body = find_rigid_body(builder, path + ".on", on);
  const int inertia = builder.add_number(path + ".inertia_kg_m2", o.inertia_kg_m2, NumberRule::positive);
  const int angle = builder.add_number(path + ".angle_rad", o.angle_rad);
  const int spin = builder.add_number(path + ".spin_rad_per_s", o.spin_rad_per_s);
  const int q = builder.add_coordinate(name + ".spin_angle", "rad", angle, spin);
  builder.add_angle(name, q);
  builder.add(std::make_unique<Rotor>(name, std::vector<int>(body.begin() + 3, body.end()), q, inertia,
                                      Vector3(o.axis.data())));
}

namespace {

const RegisterSceneKind rotor_registered({
    .name = "rotor",
    .phase = ScenePhase::attached_points,
    .summary =
        "a wheel or flywheel that spins about an axis of a rigid body, whose own inertia leaves out what the wheel "
        "has about that axis",
    .example = R"(
[gravity]
z_m_per_s2 = -9.81

[rigid_body.frame]
x_m = 0.2
y_m = -0.1
z_m = 0.5
e0 = 0.8
e1 = 0.4
e2 = -0.2
e3 = 0.4
omega_x_rad_per_s = 0.5
omega_z_rad_per_s = -0.7
mass_kg = 3.0
inertia_xx_kg_m2 = 0.4
inertia_yy_kg_m2 = 0.2
inertia_zz_kg_m2 = 0.5
center_y_m = 0.1

[rotor.wheel]
on = "frame"
axis = [0.2, 1, 0.1]
inertia_kg_m2 = 0.3
angle_rad = 0.4
spin_rad_per_s = 12

[torsion_spring.brake]
angle = "wheel"
damping_N_m_s_per_rad = 0.2

[start]
given = ["frame", "wheel.spin_angle"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string on = table.text("on");
          RotorOptions o;
          o.axis = read_direction(table, "axis");
          o.inertia_kg_m2 = table.value("inertia_kg_m2", NumberRule::positive);
          o.angle_rad = table.value("angle_rad", NumberRule::any, 0);
          o.spin_rad_per_s = table.value("spin_rad_per_s", NumberRule::any, 0);
          add_rotor(builder, name, on, o);
        },
});

}  // namespace

}  // namespace costate
