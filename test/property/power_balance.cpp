// What forces, couples and drivers report as power is what they give to the mechanism: energy less the integral of all
// powers stands still, of mechanisms in which nothing else gives or takes.
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

using namespace costate;

namespace {

struct Powered {
  std::string what, scene;
  std::vector<std::string> powers;
};

const std::string kStone = R"toml([gravity]
y_m_per_s2 = -9.81
[rigid_body.stone]
x_m = 0.2
y_m = 1.0
z_m = -0.5
rotation_axis = [1, 2, -1]
angle_rad = 0.4
omega_x_rad_per_s = 0.7
vx_m_per_s = 0.3
mass_kg = 1.5
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.15
inertia_zz_kg_m2 = 0.2
[start]
given = ["stone"]
)toml";

const std::string kPendulum = R"toml([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.W]
ground = true
x_m = 2
y_m = 0.5
[point.P]
x_m = 0.8
y_m = -0.6
[bar.rod]
from = "O"
to = "P"
mass_kg = 2
length_m = 1
[angle.swing]
bar = "rod"
)toml";

const std::vector<Powered> kPowered = {
    {"a force in the plane",
     kPendulum + R"toml([force.push]
point = "P"
x_N = { kind = "sine", mean = 1, amplitude = 4, angular_frequency_rad_per_s = 3 }
y_N = 2
[start]
given = ["P.y"]
)toml",
     {"push.power"}},
    {"a force that is a formula",
     kPendulum + R"toml([force.wind]
point = "P"
formula_x_N = "-c*(P.x_dot - w)*sqrt((P.x_dot - w)^2 + 0.1)"
formula_y_N = "sin(2*t)*swing.angle_dot"
c = 0.4
w = 2
[start]
given = ["P.y"]
)toml",
     {"wind.power"}},
    {"a torque, and one that is a formula",
     R"toml([body.wheel]
x_m = 0
y_m = 0
angle_rad = 0.3
mass_kg = 2
inertia_kg_m2 = 0.05
[body.disc]
x_m = 1
y_m = 0
angle_rad = 0
mass_kg = 1
inertia_kg_m2 = 0.02
[couple.gas]
angle = "wheel"
formula = "p*(1.2 + cos(wheel.angle))^(-1.4)*sin(wheel.angle) - 0.02*wheel.angle_dot"
p = 0.5
[couple.between]
angles = ["wheel", "disc"]
torque_N_m = { kind = "sine", mean = 0.1, amplitude = 0.2, angular_frequency_rad_per_s = 3 }
[couple.governor]
angles = ["wheel", "disc"]
formula = "k*(3 - disc.angle_dot)"
k = 0.02
[start]
given = ["wheel.x", "wheel.y", "wheel.angle", "disc.x", "disc.y", "disc.angle"]
)toml",
     {"gas.power", "between.power", "governor.power"}},
    {"a force in space along the ground's axes",
     R"toml([point.corner]
on = "stone"
x_m = 0.1
y_m = -0.2
z_m = 0.3
[force.push]
point = "corner"
x_N = 2
z_N = { kind = "sine", mean = 1, amplitude = 2, angular_frequency_rad_per_s = 5 }
)toml" + kStone,
     {"push.power"}},
    {"a force that turns with its body, and couples",
     R"toml([point.corner]
on = "stone"
x_m = 0.1
y_m = -0.2
z_m = 0.3
[force.jet]
point = "corner"
frame = "body"
y_N = 3
[couple.turn]
body = "stone"
x_N_m = 0.3
y_N_m = -0.2
[couple.own]
body = "stone"
frame = "body"
z_N_m = 0.1
)toml" + kStone,
     {"jet.power", "turn.power", "own.power"}},
    {"a motor",
     kPendulum + R"toml([driver.motor]
coordinate = "swing.angle"
law = { kind = "sine", mean = -0.6435011087932844, amplitude = 0.5, angular_frequency_rad_per_s = 4 }
[start]
given = []
)toml",
     {"motor.power"}},
    {"a ram",
     kPendulum + R"toml([distance_driver.ram]
from = "W"
to = "P"
length_m = { kind = "sine", mean = 1.6278820596099706, amplitude = 0.1, angular_frequency_rad_per_s = 4 }
[start]
given = []
)toml",
     {"ram.power"}},
    {"actuators along a line and about angles",
     kPendulum + R"toml([body.disc]
x_m = 1.5
y_m = 0.2
angle_rad = 0.3
mass_kg = 1
inertia_kg_m2 = 0.1
[actuator.ram]
from = "W"
to = "P"
time_constant_s = 0.1
initial_force_N = 5
command_N = { kind = "sine", mean = 10, amplitude = 4, angular_frequency_rad_per_s = 6 }
[actuator.motor]
angle = "swing"
time_constant_s = 0.05
command_N_m = 2
[actuator.clutch]
angles = ["swing", "disc"]
time_constant_s = 0.2
command_N_m = 0.5
[start]
given = ["P.y", "disc.x", "disc.y", "disc.angle"]
)toml",
     {"ram.power", "motor.power", "clutch.power"}},
};

Problem balance(const Powered& c, double t_end) {
  std::string text = c.scene + "[[cost.terminal]]\nkind = \"value\"\noutput = \"energy.total\"\n";
  for (const auto& p : c.powers) text += "[[cost.running]]\nkind = \"value\"\nweight = -1\noutput = \"" + p + "\"\n";
  text += "[run]\nt_end_s = " + std::to_string(t_end) + "\nrtol = 1e-10\n";
  return make_problem(Scene::parse(text, "power.toml"));
}

}  // namespace

TEST_CASE("power: energy changes by the powers that forces, couples and drivers report") {
  for (const Powered& c : kPowered)
    for (const char* formulation : {"index1", "baumgarte", "maggi"}) {
      INFO(c.what << ", " << formulation);
      double size = 0, first = 0;
      for (const double t_end : {0.01, 0.4, 1.0}) {
        Problem p = balance(c, t_end);
        p.formulation = formulation;
        const double kept = simulate(p, {}).psi;
        if (t_end == 0.01) first = kept;
        size = std::max({size, std::abs(kept), 1.0});
        // Some hundred steps, each within the tolerance of velocities that energy doubles.
        CHECK(std::abs(kept - first) <= 1e3 * 1e-10 * size * 10);
      }
      // A power that is zero throughout would pass: without it the energy does change.
      Powered without = c;
      without.powers.clear();
      Problem a = balance(without, 0.01), b = balance(without, 1.0);
      a.formulation = b.formulation = formulation;
      CHECK(std::abs(simulate(a, {}).psi - simulate(b, {}).psi) > 1e-3 * size);
    }
}

TEST_CASE("power: what a motor's torque is, by hand") {
  // A rod of 2 kg and 1 m about its end, turned as the law says: T = I phi'' + m g (l/2) cos phi.
  Powered c = kPowered[5];
  for (const double t_end : {0.3, 0.8}) {
    const std::string text =
        c.scene +
        "[[cost.terminal]]\nkind = \"value\"\noutput = \"motor.torque\"\n[run]\nt_end_s = " + std::to_string(t_end) +
        "\nrtol = 1e-10\n";
    Problem p = make_problem(Scene::parse(text, "torque.toml"));
    const double phi = -0.6435011087932844 + 0.5 * std::sin(4 * t_end), phidd = -8 * std::sin(4 * t_end);
    const double torque = 2.0 / 3 * phidd + 2 * 9.81 * 0.5 * std::cos(phi);
    CHECK(simulate(p, {}).psi == Approx(torque).epsilon(1e-7));
  }
}
