// Contacts between two bodies: what comes back from a blow, what is conserved, and gradients through it, in the plane
// and in space.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/element/force/contact_laws.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Contains;

namespace {

// Two discs, of 1.5 kg with 0.1 m and of 0.8 kg with 0.15 m, without gravity; they meet after some 10 ms.
std::string discs(double height, const std::string& contact, const std::string& output, double t_end = 0.2) {
  return fmt::format(R"([body.ball]
x_m = 0
y_m = 0
vx_m_per_s = 0.6
angular_velocity_rad_per_s = 3
mass_kg = 1.5
inertia_kg_m2 = 0.006

[body.disc]
x_m = 0.26
y_m = {}
vx_m_per_s = -0.4
mass_kg = 0.8
inertia_kg_m2 = 0.009

[point.C]
on = "ball"
x_m = 0
y_m = 0

[point.D]
on = "disc"
x_m = 0
y_m = 0

[contact_pair.blow]
point = "C"
radius_m = 0.1
other = "D"
other_radius_m = 0.15
stiffness_N_per_m_n = 2e4
{}

[start]
given = ["ball.x", "ball.y", "ball.angle", "disc.x", "disc.y", "disc.angle"]

[[cost.terminal]]
kind = "value"
output = "{}"

[run]
t_end_s = {}
rtol = 1e-11
)",
                     height, contact, output, t_end);
}

// The same of spheres.
std::string spheres(const std::string& contact, const std::string& output, double t_end = 0.2) {
  return fmt::format(R"([rigid_body.ball]
x_m = 0
y_m = 0
z_m = 0
vx_m_per_s = 0.6
rotation_axis = [1, -0.8, 2]
angle_rad = 0.25
omega_x_rad_per_s = 2
omega_z_rad_per_s = 3
mass_kg = 1.5
inertia_xx_kg_m2 = 0.006
inertia_yy_kg_m2 = 0.006
inertia_zz_kg_m2 = 0.006

[rigid_body.disc]
x_m = 0.25
y_m = 0.05
z_m = 0.04
vx_m_per_s = -0.4
mass_kg = 0.8
inertia_xx_kg_m2 = 0.009
inertia_yy_kg_m2 = 0.007
inertia_zz_kg_m2 = 0.008

[point.C]
on = "ball"
x_m = 0
y_m = 0
z_m = 0

[point.D]
on = "disc"
x_m = 0
y_m = 0
z_m = 0

[contact_pair.blow]
point = "C"
radius_m = 0.1
other = "D"
other_radius_m = 0.15
stiffness_N_per_m_n = 2e4
{}

[[cost.terminal]]
kind = "value"
output = "{}"

[run]
t_end_s = {}
rtol = 1e-11
)",
                     contact, output, t_end);
}

double at_end(const std::string& scene, double rtol = 1e-11) {
  Problem p = make_problem(Scene::parse(scene, "pair.toml"));
  p.formulation = "index1";
  p.solver.rtol = rtol;
  return simulate(p, p.parameters.values()).psi;
}

const std::string kFrictional =
    "law = \"lee-wang\"\nrestitution = 0.6\nfriction = \"coulomb\"\nfriction_coefficient = 0.3\nenergy_lost = true";

}  // namespace

// Bodies that meet head on part with the speed that the law gives the reduced mass (lib/README.md (17)): a run at rtol
// 1e-12 is good to some 1e-9 of it, and to 1e-8 where little comes back.
TEST_CASE("contact pair: restitution comes out, and momentum stays") {
  for (const auto& [name, law] :
       {std::pair("hunt-crossley", NormalLaw::hunt_crossley),
        std::pair("lankarani-nikravesh", NormalLaw::lankarani_nikravesh), std::pair("flores", NormalLaw::flores)})
    for (const double e : {0.3, 0.8}) {
      INFO(name << " " << e);
      const std::string contact = fmt::format("law = \"{}\"\nrestitution = {}", name, e);
      const double ball = at_end(discs(0, contact, "ball.x_dot"), 1e-12),
                   disc = at_end(discs(0, contact, "disc.x_dot"), 1e-12);
      CHECK(std::abs(1.5 * ball + 0.8 * disc - (1.5 * 0.6 - 0.8 * 0.4)) < 1e-9);
      const double out = (disc - ball) / 1.0, chi = damping_ratio(law, e);
      CHECK(std::abs(chi * (1 + out) - std::log((1 + chi) / (1 - chi * out))) < 1e-8);
    }
}

// Friction acts at the point where they touch, the same on both: momentum and angular momentum about the origin stay,
// and what energy goes is what is booked as lost. Each run is good to some 1e-9 of values about 1.
TEST_CASE("contact pair: an oblique blow with friction keeps momenta, and books what is lost") {
  const auto of = [](const std::string& output) { return at_end(discs(0.08, kFrictional, output)); };
  const double p = 1.5 * of("ball.y_dot") + 0.8 * of("disc.y_dot");
  CHECK(std::abs(p) < 1e-9);
  const double L = 1.5 * (of("ball.x") * of("ball.y_dot") - of("ball.y") * of("ball.x_dot")) +
                   0.8 * (of("disc.x") * of("disc.y_dot") - of("disc.y") * of("disc.x_dot")) +
                   0.006 * of("ball.angle_dot") + 0.009 * of("disc.angle_dot");
  CHECK(std::abs(L - (0.006 * 3 + 0.8 * 0.08 * 0.4)) < 1e-9);
  const double before = 0.5 * (1.5 * 0.36 + 0.8 * 0.16 + 0.006 * 9), after = of("energy.kinetic");
  const double lost = of("blow.energy_lost");
  CHECK(lost > 0.05);
  CHECK(std::abs(before - after - lost) < 1e-8);
  CHECK(std::abs(of("disc.angle_dot")) > 0.05);  // friction did turn it
  // In space.
  const auto in_space = [](const std::string& output, double t_end) {
    return at_end(spheres(kFrictional, output, t_end));
  };
  const double gone = in_space("energy.kinetic", 1e-6) - in_space("energy.kinetic", 0.2);
  CHECK(in_space("blow.energy_lost", 0.2) > 0.02);
  CHECK(std::abs(gone - in_space("blow.energy_lost", 0.2)) < 1e-8);
  for (const char* axis : {"x", "y", "z"}) {
    const std::string rate = fmt::format("{}_dot", axis);
    CHECK(std::abs(1.5 * in_space("ball." + rate, 0.2) + 0.8 * in_space("disc." + rate, 0.2) -
                   (*axis == 'x' ? 1.5 * 0.6 - 0.8 * 0.4 : 0)) < 1e-9);
  }
}

// Two discs on fixed axes, 2 mm into each other, friction until they roll on each other in the middle of that: with the
// impulse J of friction I_a (w_a - w_a0)/l_a = I_b w_b/l_b, and w_a l_a + w_b l_b = 0 in the end, l = R - 1 mm.
TEST_CASE("contact pair: discs that rub come to roll on each other") {
  const auto scene = [](const std::string& output) {
    return fmt::format(R"([body.drum]
x_m = 0
y_m = 0
angular_velocity_rad_per_s = 30
mass_kg = 1
inertia_kg_m2 = 0.004

[body.wheel]
x_m = 0
y_m = 0.248
mass_kg = 1
inertia_kg_m2 = 0.01

[point.C]
on = "drum"
x_m = 0
y_m = 0

[point.D]
on = "wheel"
x_m = 0
y_m = 0

[driver.drum_x]
coordinate = "drum.x"
law = 0

[driver.drum_y]
coordinate = "drum.y"
law = 0

[driver.wheel_x]
coordinate = "wheel.x"
law = 0

[driver.wheel_y]
coordinate = "wheel.y"
law = 0.248

[contact_pair.nip]
point = "C"
radius_m = 0.1
other = "D"
other_radius_m = 0.15
law = "hertz"
stiffness_N_per_m_n = 1e5
friction = "coulomb"
friction_coefficient = 0.5
transition_velocity_m_per_s = 0.001

[start]
given = ["drum.angle", "wheel.angle"]

[[cost.terminal]]
kind = "value"
output = "{}"

[run]
t_end_s = 3
rtol = 1e-9
)",
                       output);
  };
  const double a = at_end(scene("drum.angle_dot"), 1e-9), b = at_end(scene("wheel.angle_dot"), 1e-9);
  constexpr double Ia = 0.004, Ib = 0.01, la = 0.099, lb = 0.149;
  CHECK(std::abs(Ia * a * lb - Ib * b * la - Ia * 30 * lb) < 1e-9);
  // What is left of the slip has died away like exp(-mu N/(m v_s) t).
  CHECK(std::abs(la * a + lb * b) < 1e-7);
  CHECK(b == Catch::Detail::Approx(-30 * Ia * la * lb / (Ia * lb * lb + Ib * la * la)).epsilon(1e-6));
}

TEST_CASE("contact pair: gradients through a blow equal differences", "[events]") {
  const std::vector<std::string> of_contact = {"contact_pair.blow.stiffness_N_per_m_n", "contact_pair.blow.restitution",
                                               "contact_pair.blow.radius_m", "contact_pair.blow.other_radius_m",
                                               "contact_pair.blow.friction_coefficient"};
  for (const bool space : {false, true}) {
    const std::string scene = space ? spheres(kFrictional, "disc.y") : discs(0.08, kFrictional, "disc.angle");
    std::vector<std::string> parameters = of_contact;
    parameters.emplace_back(space ? "rigid_body.disc.mass_kg" : "body.disc.mass_kg");
    Problem p = make_problem(Scene::parse(scene, "pair.toml"), parameters);
    const auto rho = p.parameters.values();
    p.formulation = "index1";
    const GradientResult oracle = gradient(p, "differences", rho);
    p.solver.rtol = 1e-9;
    for (const auto& [formulation, method] :
         {std::pair("index1", "idas-adjoint"), std::pair("index1", "cvodes-forward"),
          std::pair("baumgarte", "cvodes-adjoint"), std::pair("index2", "idas-adjoint"),
          std::pair("maggi", "cvodes-adjoint")}) {
      if (!space && std::string(formulation) == "maggi") continue;  // no constraint to choose coordinates by
      INFO((space ? "space " : "plane ") << formulation << " " << method);
      p.formulation = formulation;
      const GradientResult r = gradient(p, method, rho);
      CHECK(r.counters.jumps == 2);
      // Scaled by the parameter: a thousand times rtol of the largest, as an adjoint costs.
      double size = 0;
      for (std::size_t j = 0; j < rho.size(); ++j) size = std::max(size, std::abs(rho[j] * oracle.gradient[j]));
      for (std::size_t j = 0; j < rho.size(); ++j) {
        INFO(parameters[j] << " " << r.gradient[j] << " " << oracle.gradient[j]);
        CHECK(std::abs(rho[j] * (r.gradient[j] - oracle.gradient[j])) < 1e-6 * size);
      }
    }
  }
}

TEST_CASE("contact pair: what cannot be is refused by name") {
  const auto said = [](const std::string& scene) {
    try {
      make_problem(Scene::parse(scene, "pair.toml"));
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  CHECK_THAT(said(spheres("friction = \"dahl\"\nfriction_coefficient = 0.3\nrestitution = 0.5", "disc.y")),
             Contains("contact_pair.blow") && Contains("Bristles of 'dahl'"));
  std::string same = discs(0, "restitution = 0.5", "disc.x");
  same.replace(same.find("other = \"D\""), 11, "other = \"C\"");
  CHECK_THAT(said(same), Contains("'C' and 'C' are on one body"));
  std::string points = discs(0, "restitution = 0.5", "disc.x");
  points.replace(points.find("radius_m = 0.1\n"), 15, "");
  points.replace(points.find("other_radius_m = 0.15\n"), 22, "");
  CHECK_THAT(said(points), Contains("Two points never touch"));
}

// The first step, 5 % of a radius of 0.1 m, would begin 3 mm within the other disc, where there is no start.
TEST_CASE("contact pair: differences go as far as there are runs to both sides") {
  std::string near = discs(0.03, "restitution = 0.7", "disc.y", 0.1) +
                     "parameters = [\"contact_pair.blow.radius_m\", \"contact_pair.blow.other_radius_m\"]\n";
  const std::string apart = "x_m = 0.26\n";
  near.replace(near.find(apart), apart.size(), "x_m = 0.252\n");
  Problem p = make_problem(Scene::parse(near, "discs.toml"));
  p.solver.rtol = 1e-9;
  const std::vector<double> rho = p.parameters.values();
  const GradientResult r = gradient(p, "differences", rho), exact = gradient(p, "idas-adjoint", rho);
  for (std::size_t j = 0; j < rho.size(); ++j) {
    CAPTURE(j);
    // Of both methods, runs at rtol 1e-9 through a contact; what they state themselves is more.
    CHECK(r.gradient[j] == Approx(exact.gradient[j]).epsilon(1e-5));
    CHECK(std::abs(r.gradient[j] - exact.gradient[j]) <= r.gradient_error[j] + 1e-6 * std::abs(exact.gradient[j]));
  }
}
