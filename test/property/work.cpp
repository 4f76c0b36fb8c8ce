// The work of forces, couples and actuators, integrated with the motion. At every sample it is what the energy has
// changed by; as a cost it has the gradient and the Hessian of the integral of the power, whose derivatives are those
// of a running cost and share nothing with the blocks of a force state.
#include <fmt/format.h>
#include <support/variants.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/hessian.h"
#include "gradient_compare.h"
#include "hessian_compare.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

namespace {

struct Worker {
  std::string what, scene;
  std::vector<std::string> names, parameters;
};

const std::vector<Worker> kWorkers = {
    {"of the plane: an arm and a disc",
     R"toml([gravity]
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
[point.middle]
on = "rod"
x_m = 0.5
y_m = 0.1
[body.disc]
x_m = 1.5
y_m = 0.2
angle_rad = 0.3
mass_kg = 1
inertia_kg_m2 = 0.1
[force.push]
point = "middle"
x_N = { kind = "sine", mean = 1, amplitude = 4, angular_frequency_rad_per_s = 3 }
y_N = 2
work = true
[force.wind]
point = "P"
formula_x_N = "-c*(P.x_dot - w)*sqrt((P.x_dot - w)^2 + 0.1)"
c = 0.4
w = 2
work = true
[couple.between]
angles = ["swing", "disc"]
torque_N_m = { kind = "sine", mean = 0.1, amplitude = 0.2, angular_frequency_rad_per_s = 3 }
work = true
[couple.governor]
angle = "disc"
formula = "k*(3 - disc.angle_dot)"
k = 0.02
work = true
[actuator.ram]
from = "W"
to = "P"
time_constant_s = 0.1
initial_force_N = 5
command_N = { kind = "sine", mean = 10, amplitude = 4, angular_frequency_rad_per_s = 6 }
work = true
[actuator.motor]
angle = "swing"
time_constant_s = 0.05
command_N_m = 2
work = true
[actuator.clutch]
angles = ["swing", "disc"]
time_constant_s = 0.2
command_N_m = 0.5
work = true
[actuator.servo]
angle = "swing"
time_constant_s = 0.02
formula = "stiff*(0.4*sin(2*t) - swing.angle) - damp*disc.angle_dot"
stiff = 3
damp = 0.2
work = true
[actuator.winch]
from = "middle"
to = "W"
time_constant_s = 0.05
initial_force_N = 1
formula = "gain*(P.y - disc.y)*(1 + disc.x_dot)"
gain = 4
work = true
[start]
given = ["P.y", "disc.x", "disc.y", "disc.angle"]
)toml",
     {"push", "wind", "between", "governor", "ram", "motor", "clutch", "servo", "winch"},
     {"force.push.x_N.amplitude", "force.wind.c", "couple.governor.k", "couple.between.torque_N_m.mean",
      "actuator.ram.time_constant_s", "actuator.motor.command_N_m", "actuator.clutch.command_N_m", "bar.rod.mass_kg",
      "body.disc.inertia_kg_m2", "point.middle.x_m", "actuator.ram.initial_force_N", "actuator.servo.stiff",
      "actuator.servo.time_constant_s", "actuator.winch.gain", "actuator.winch.initial_force_N"}},
    {"of space: a stone",
     R"toml([gravity]
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
[point.corner]
on = "stone"
x_m = 0.1
y_m = -0.2
z_m = 0.3
[point.mast]
ground = true
x_m = 0.5
y_m = 2.0
z_m = 0.1
[force.jet]
point = "corner"
frame = "body"
y_N = 3
work = true
[force.wind]
point = "corner"
formula_z_N = "-g*corner.z_dot + stone.e1*corner.x"
g = 0.3
work = true
[couple.turn]
body = "stone"
x_N_m = 0.3
y_N_m = -0.2
work = true
[couple.own]
body = "stone"
frame = "body"
z_N_m = 0.1
work = true
[actuator.rope]
from = "mast"
to = "corner"
time_constant_s = 0.1
command_N = 4
work = true
[actuator.winch]
from = "corner"
to = "mast"
time_constant_s = 0.05
formula = "gain*(corner.y_dot + stone.x)*exp(-t)"
gain = 2
work = true
[start]
given = ["stone"]
)toml",
     {"jet", "wind", "turn", "own", "rope", "winch"},
     {"force.jet.y_N", "force.wind.g", "couple.turn.x_N_m", "couple.own.z_N_m", "actuator.rope.command_N",
      "actuator.winch.gain", "rigid_body.stone.mass_kg", "rigid_body.stone.inertia_yy_kg_m2", "point.corner.x_m",
      "point.mast.y_m"}},
};

/// Each with a weight of its own, so that none stands for another.
std::string terms(const Worker& c, bool integrals) {
  std::string text;
  double weight = 1;
  for (const auto& name : c.names) {
    text += fmt::format("[[cost.{}]]\nkind = \"value\"\nweight = {}\noutput = \"{}.{}\"\n",
                        integrals ? "running" : "terminal", weight, name, integrals ? "power" : "work");
    weight = -1.3 * weight;
  }
  return text;
}
Problem problem(const Worker& c, const std::string& cost, double t_end, double rtol) {
  Problem p = make_problem(
      Scene::parse(c.scene + cost + fmt::format("[run]\nt_end_s = {}\nrtol = {}\n", t_end, rtol), "work.toml"));
  p.parameters = p.mechanism->select(c.parameters);
  return p;
}

Scene motor(const std::string& torque, const std::string& cost) {
  return Scene::parse(R"toml([body.wheel]
x_m = 0
y_m = 0
angle_rad = 0.3
mass_kg = 2
inertia_kg_m2 = 0.05
)toml" + torque + R"toml(
[start]
given = ["wheel.x", "wheel.y", "wheel.angle"]
[run]
t_end_s = 2
rtol = 1e-10
)toml" + cost,
                      "motor.toml");
}

}  // namespace

TEST_CASE("work: what the energy has changed by, at every sample") {
  for (const Worker& c : kWorkers)
    for (const char* formulation : {"index1", "baumgarte", "maggi", "index3"}) {
      INFO(c.what << ", " << formulation);
      Problem p = problem(c, "", 1, 1e-10);
      p.formulation = formulation;
      std::vector<std::unique_ptr<Output>> works;
      for (const auto& name : c.names) works.push_back(make_output(*p.mechanism, name + ".work"));
      const auto energy = make_output(*p.mechanism, "energy.total");
      std::vector<double> times, kept;
      for (int i = 0; i <= 37; ++i) times.push_back(i / 37.0);
      double most = 0;
      simulate(p, p.parameters.values(), times, [&](const MechanismState& s, System& system) {
        double sum = 0;
        for (const auto& w : works) {
          const double done = w->value(s, system.assembly());
          if (s.t == 0) CHECK(done == 0);
          sum += done;
        }
        most = std::max(most, std::abs(sum));
        kept.push_back(energy->value(s, system.assembly()) - sum);
      });
      REQUIRE(kept.size() == times.size());
      // Some hundred steps, each within the tolerance of velocities that energy doubles.
      for (const double e : kept) CHECK(std::abs(e - kept[0]) <= 1e3 * 1e-10 * 10 * std::max(1.0, std::abs(kept[0])));
      CHECK(most > 1);
    }
}

// Tolerances as in gradients.cpp: the errors of some 1e3 steps of rtol.
TEST_CASE("work: as a cost it has the gradient of the integral of the power, by every method") {
  const double rtol = 1e-9;
  for (const Worker& c : kWorkers) {
    Problem p = problem(c, terms(c, true), 0.5, rtol);
    p.formulation = "baumgarte";
    const GradientResult right = gradient(p, "cvodes-forward", p.parameters.values());
    for (const auto& f : formulations()) {
      if (!f.exact_constraints()) continue;
      Problem of_work = problem(c, terms(c, false), 0.5, rtol);
      of_work.formulation = f.name;
      for (const auto& method : integrator_methods(f.name)) {
        INFO(c.what << ", " << f.name << " x " << method);
        const GradientResult r = gradient(of_work, method, of_work.parameters.values());
        CHECK(r.psi == Approx(right.psi).epsilon(1e3 * rtol));
        CHECK_BELOW(gradient_mismatch(r.gradient, right.gradient, p.parameters), 1e3 * rtol);
      }
    }
  }
}

TEST_CASE("work: as a cost it has the Hessian of the integral of the power") {
  for (const Worker& c : kWorkers) {
    Problem a = problem(c, terms(c, false), 0.5, 1e-9), b = problem(c, terms(c, true), 0.5, 1e-9);
    a.formulation = b.formulation = "baumgarte";
    INFO(c.what);
    CHECK(apart(a, hessian(a, a.parameters.values()).matrix, hessian(b, b.parameters.values()).matrix) <= 1e-6);
  }
}

// phi'' = T/I from rest: W = T (phi - phi_0) = T^2 t^2/(2 I), positive where a positive torque turns the angle forward.
TEST_CASE("work: a couple's and an actuator's torque have one sign") {
  const auto end = [](const std::string& torque, const std::string& output) {
    Problem p = make_problem(motor(torque, "[[cost.terminal]]\nkind = \"value\"\noutput = \"" + output + "\"\n"));
    return simulate(p, p.parameters.values()).psi;
  };
  const std::string couple = "[couple.M]\nangle = \"wheel\"\ntorque_N_m = 0.4\nwork = true\n";
  // In balance with its command from the start on.
  const std::string actuator =
      "[actuator.M]\nangle = \"wheel\"\ntime_constant_s = 0.1\ninitial_torque_N_m = 0.4\ncommand_N_m = 0.4\nwork = "
      "true\n";
  for (const auto& torque : {couple, actuator}) {
    INFO(torque);
    CHECK(end(torque, "M.torque") == Approx(0.4).epsilon(1e-12));
    CHECK(end(torque, "wheel.angle") == Approx(0.3 + 0.4 * 2 * 2 / (2 * 0.05)).epsilon(1e-8));
    CHECK(end(torque, "M.power") == Approx(0.4 * 0.4 * 2 / 0.05).epsilon(1e-8));
    CHECK(end(torque, "M.work") == Approx(0.16 * 4 / (2 * 0.05)).epsilon(1e-8));
  }
}

TEST_CASE("work: who asks for it where it is not says where it is") {
  const auto with = [](const std::string& torque, const std::string& output) {
    return [=] { make_problem(motor(torque, "[[cost.terminal]]\nkind = \"value\"\noutput = \"" + output + "\"\n")); };
  };
  CHECK_THROWS_WITH(with("[couple.M]\nangle = \"wheel\"\ntorque_N_m = 0.4\n", "M.work")(),
                    Contains("motor.toml:18") && Contains("There is no output 'M.work'") &&
                        Contains("'work = true' stands in [couple.M]"));
  const std::string driver = "[driver.D]\ncoordinate = \"wheel.x\"\nlaw = 0\n";
  CHECK_THROWS_WITH(with(driver, "D.work")(), Contains("'D.power' is the work of this driver"));
  CHECK_THROWS_WITH(with(driver + "work = true\n", "D.power")(),
                    Contains("motor.toml:10") && Contains("is not integrated for drivers"));
  CHECK_THROWS_WITH(with("[couple.M]\nangle = \"wheel\"\ntorque_N_m = 0.4\nwork = 1\n", "M.work")(),
                    Contains("motor.toml:10"));
}
