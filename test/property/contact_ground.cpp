// Contact with a ground that is no plane at rest: profiles of roads, posts, bodies that carry it.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/gradient_compare.h"

using namespace costate;
using Catch::Contains;
using Catch::Detail::Approx;

namespace {

// A ball thrown onto waves on a slope: five touches, sliding and rolling.
constexpr const char* kWaves = R"([gravity]
y_m_per_s2 = -9.81

[road.hill]
kind = "profile"
law = { kind = "sine", amplitude = 0.1, angular_frequency_rad_per_s = 2.0, phase_rad = 0.3 }

[body.ball]
x_m = 0
y_m = 0.35
angle_rad = 0.1
vx_m_per_s = 1.2
vy_m_per_s = -0.3
angular_velocity_rad_per_s = 2
mass_kg = 1.5
inertia_kg_m2 = 0.006

[point.C]
on = "ball"
x_m = 0
y_m = 0

[contact.floor]
point = "C"
law = "flores"
stiffness_N_per_m_n = 2e4
restitution = 0.6
radius_m = 0.1
road = "hill"
ground_height_m = 0.02
ground_angle_rad = -0.05
friction = "stribeck"
friction_coefficient = 0.4
static_coefficient = 0.5
transition_velocity_m_per_s = 0.05
energy_lost = true

[start]
given = ["ball.x", "ball.y", "ball.angle"]

[[cost.terminal]]
kind = "value"
output = "ball.x"

[[cost.running]]
kind = "square"
output = "ball.y"

[run]
t_end_s = 1.5
)";

Problem problem_of(const std::string& scene, const std::vector<std::string>& parameters, double rtol) {
  Problem p = make_problem(Scene::parse(scene, "ground.toml"), parameters);
  p.solver.rtol = p.solver.atol = rtol;
  return p;
}

std::string changed(std::string scene, const std::string& from, const std::string& to) {
  const auto at = scene.find(from);
  REQUIRE(at != std::string::npos);
  return scene.replace(at, from.size(), to);
}

void check_gradients(Problem problem, double allowed) {
  const auto rho = problem.parameters.values();
  problem.formulation = "index1";
  const GradientResult oracle = gradient(problem, "differences", rho);
  for (const auto& [formulation, method] :
       {std::pair("index1", "idas-forward"), std::pair("index1", "cvodes-adjoint"),
        std::pair("baumgarte", "idas-adjoint"), std::pair("baumgarte", "cvodes-forward"),
        std::pair("penalty", "cvodes-adjoint"), std::pair("maggi", "cvodes-adjoint"),
        std::pair("index2", "idas-adjoint"), std::pair("index3", "idas-adjoint")}) {
    INFO(formulation << " " << method);
    problem.formulation = formulation;
    const GradientResult r = gradient(problem, method, rho);
    CHECK(r.psi == Approx(oracle.psi).epsilon(allowed));
    const auto mismatch = test::gradient_mismatch(r.gradient, oracle.gradient, problem.parameters);
    INFO(mismatch.text);
    CHECK(mismatch.error < allowed);
  }
}

}  // namespace

// The numbers are those of a program apart: the nearest point of the sine by minimization, DOP853 at 1e-11 from touch
// to touch. Gradients amplify what a run is off by from touch to touch: 1e-6 of rtol 1e-10.
TEST_CASE("contact on a profile: a ball on waves, as another program has it, gradients", "[events]") {
  Problem p = problem_of(kWaves,
                         {"road.hill.law.amplitude", "road.hill.law.angular_frequency_rad_per_s",
                          "contact.floor.radius_m", "contact.floor.friction_coefficient", "contact.floor.restitution",
                          "contact.floor.ground_angle_rad", "contact.floor.ground_height_m", "body.ball.vx_m_per_s"},
                         1e-10);
  CHECK(simulate(p, p.parameters.values()).psi == Approx(0.9561097149).epsilon(1e-8));
  check_gradients(p, 1e-6);
}

namespace {

double at_end(const std::string& scene, const std::string& output, double t_end, const std::string& formulation) {
  Problem p =
      problem_of(scene + fmt::format("\n[[cost.terminal]]\nkind = \"value\"\noutput = \"{}\"\n", output), {}, 1e-11);
  p.solver.t_end = t_end;
  p.formulation = formulation;
  return simulate(p, p.parameters.values()).psi;
}

// The ball above and a plank that floats, which has waves or is a plane; no cost.
std::string on_plank(bool waves) {
  std::string scene = kWaves;
  scene = scene.substr(0, scene.find("[[cost"));
  scene = changed(scene, "y_m_per_s2 = -9.81", "y_m_per_s2 = 0");
  scene = changed(scene, "[body.ball]", R"([body.plank]
x_m = 0.1
y_m = 0.05
angle_rad = 0.05
vx_m_per_s = 0.2
angular_velocity_rad_per_s = 0.3
mass_kg = 2
inertia_kg_m2 = 0.3

[body.ball])");
  scene =
      changed(scene, "road = \"hill\"", waves ? "road = \"hill\"\nground_body = \"plank\"" : "ground_body = \"plank\"");
  scene = changed(scene, "radius_m = 0.1", "radius_m = 0.1\nrolling_resistance_m = 0.002");
  scene = changed(scene, "given = [", "given = [\"plank.x\", \"plank.y\", \"plank.angle\", ");
  return changed(scene, "vy_m_per_s = -0.3", "vy_m_per_s = -1.5");
}

}  // namespace

// Linear and angular momentum of both stay, and the energy that is missing was lost in contact: at rtol 1e-11, to 1e-9,
// of which energies hold 1e-8.
TEST_CASE("contact on a body: momenta stay, and the energy lost is what is missing", "[events]") {
  for (const bool waves : {true, false}) {
    CAPTURE(waves);
    const std::string scene = on_plank(waves);
    const auto of = [&](const std::string& output) { return at_end(scene, output, 0.5, "baumgarte"); };
    CHECK(std::abs(1.5 * of("ball.x_dot") + 2 * of("plank.x_dot") - (1.5 * 1.2 + 2 * 0.2)) < 1e-9);
    CHECK(std::abs(1.5 * of("ball.y_dot") + 2 * of("plank.y_dot") - 1.5 * -1.5) < 1e-9);
    const double L = 1.5 * (of("ball.x") * of("ball.y_dot") - of("ball.y") * of("ball.x_dot")) +
                     2 * (of("plank.x") * of("plank.y_dot") - of("plank.y") * of("plank.x_dot")) +
                     0.006 * of("ball.angle_dot") + 0.3 * of("plank.angle_dot");
    CHECK(std::abs(L - (-1.5 * 0.35 * 1.2 - 2 * 0.05 * 0.2 + 0.006 * 2 + 0.3 * 0.3)) < 1e-9);
    const double before = 0.5 * (1.5 * (1.2 * 1.2 + 1.5 * 1.5) + 2 * 0.2 * 0.2 + 0.006 * 4 + 0.3 * 0.09),
                 lost = of("floor.energy_lost");
    CHECK(lost > 0.3);
    CHECK(std::abs(before - of("energy.total") - lost) < 1e-8);
  }
}

TEST_CASE("contact on a body: gradients equal differences", "[events]") {
  Problem p = problem_of(changed(on_plank(true), "vy_m_per_s = -1.5", "vy_m_per_s = -1.5") + R"(
[[cost.terminal]]
kind = "value"
output = "ball.x"
[[cost.running]]
kind = "square"
output = "plank.angle"
)",
                         {"road.hill.law.amplitude", "contact.floor.radius_m", "contact.floor.ground_angle_rad",
                          "contact.floor.ground_height_m", "contact.floor.rolling_resistance_m", "body.plank.mass_kg",
                          "body.plank.angular_velocity_rad_per_s", "body.ball.vx_m_per_s"},
                         1e-10);
  p.solver.t_end = 0.5;
  check_gradients(p, 1e-6);
}

// A plate that moves up and down by a law of time is a post; one that drivers move so carries its plane: the same
// motion.
TEST_CASE("contact on a post: as on a body that is driven so, gradients", "[events]") {
  const std::string law = R"({ kind = "sine", amplitude = 0.04, angular_frequency_rad_per_s = 20, phase_rad = 0.3 })";
  std::string post = changed(kWaves, "kind = \"profile\"", "kind = \"post\"");
  post =
      changed(post, R"({ kind = "sine", amplitude = 0.1, angular_frequency_rad_per_s = 2.0, phase_rad = 0.3 })", law);
  post = changed(post, "ground_angle_rad = -0.05", "ground_angle_rad = 0");
  std::string driven = changed(post, "road = \"hill\"", "ground_body = \"plate\"");
  driven = changed(driven, "[body.ball]",
                   fmt::format(R"([body.plate]
x_m = 0
y_m = 0
angle_rad = 0
mass_kg = 1
inertia_kg_m2 = 1

[driver.plate_x]
coordinate = "plate.x"
law = 0

[driver.plate_y]
coordinate = "plate.y"
law = {}

[driver.plate_angle]
coordinate = "plate.angle"
law = 0

[body.ball])",
                               law));
  const auto psi = [](const std::string& scene) {
    Problem p = problem_of(scene, {}, 1e-11);
    return simulate(p, p.parameters.values()).psi;
  };
  CHECK(psi(post) == Approx(psi(driven)).epsilon(1e-8));
  check_gradients(
      problem_of(post,
                 {"road.hill.law.amplitude", "road.hill.law.phase_rad", "road.hill.law.angular_frequency_rad_per_s",
                  "contact.floor.restitution", "contact.floor.ground_height_m"},
                 1e-10),
      1e-6);
}

// In space a sphere that rolls along the profile does what the disc of the plane does.
TEST_CASE("contact on a profile: a sphere in space as a disc in the plane", "[events]") {
  std::string space = changed(kWaves, "y_m_per_s2 = -9.81", "z_m_per_s2 = -9.81");
  space = changed(space, R"([body.ball]
x_m = 0
y_m = 0.35
angle_rad = 0.1
vx_m_per_s = 1.2
vy_m_per_s = -0.3
angular_velocity_rad_per_s = 2
mass_kg = 1.5
inertia_kg_m2 = 0.006
)",
                  R"([rigid_body.ball]
x_m = 0
y_m = 0
z_m = 0.35
vx_m_per_s = 1.2
vz_m_per_s = -0.3
omega_global_y_rad_per_s = -2
mass_kg = 1.5
inertia_xx_kg_m2 = 0.006
inertia_yy_kg_m2 = 0.006
inertia_zz_kg_m2 = 0.006
)");
  space = changed(space, "x_m = 0\ny_m = 0\n\n[contact", "x_m = 0\ny_m = 0\nz_m = 0\n\n[contact");
  space = changed(space, R"(["ball.x", "ball.y", "ball.angle"])", R"(["ball"])");
  space = changed(space, "output = \"ball.y\"", "output = \"ball.z\"");
  Problem p =
      problem_of(space, {"road.hill.law.amplitude", "contact.floor.radius_m", "rigid_body.ball.vx_m_per_s"}, 1e-10);
  const auto rho = p.parameters.values();
  p.formulation = "index1";
  const GradientResult r = gradient(p, "idas-adjoint", rho);
  CHECK(r.psi == Approx(0.9561097149).epsilon(1e-7));
  const Problem plane =
      problem_of(kWaves, {"road.hill.law.amplitude", "contact.floor.radius_m", "body.ball.vx_m_per_s"}, 1e-10);
  const GradientResult same = gradient(plane, "idas-adjoint", rho);
  for (std::size_t j = 0; j < rho.size(); ++j) CHECK(r.gradient[j] == Approx(same.gradient[j]).epsilon(1e-5));
}

// Without friction and weight a point flies at 20 m/s, 1 mm above a plane with a bump of 2 cm: an integrator that sees
// nothing happen steps over it.
TEST_CASE("contact on a profile: its features are known places", "[events]") {
  Problem p = problem_of(R"([road.bump]
kind = "profile"
law = { kind = "bump", height_m = 0.001, start_m = 5, length_m = 0.02 }
[point.P]
x_m = 0
y_m = 0.001
vx_m_per_s = 20
vy_m_per_s = 0
[mass.P]
point = "P"
mass_kg = 0.1
[contact.ground]
point = "P"
road = "bump"
stiffness_N_per_m_n = 1e7
restitution = 0.5
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "value"
output = "P.y_dot"
[run]
t_end_s = 1
)",
                         {}, 1e-8);
  for (const char* formulation : {"baumgarte", "index1", "maggi"}) {
    INFO(formulation);
    p.formulation = formulation;
    CHECK(simulate(p, p.parameters.values()).psi > 0.1);
  }
}

TEST_CASE("contact on a ground that is no plane: what cannot be is refused by name") {
  const auto refused = [](const std::string& from, const std::string& to) {
    return [=] { return make_problem(Scene::parse(changed(kWaves, from, to), "ground.toml")); };
  };
  CHECK_THROWS_WITH(refused("road = \"hill\"", "road = \"hil\"")(),
                    Contains("contact.floor.road") && Contains("'hill'"));
  CHECK_THROWS_WITH(refused("road = \"hill\"", "ground_body = \"ball\"")(), Contains("is on 'ball' itself"));
  CHECK_THROWS_WITH(refused("law = \"flores\"", "kind = \"rigid\"")(),
                    Contains("contact.floor.road") && Contains("a plane at rest"));
  CHECK_THROWS_WITH(
      refused(R"({ kind = "sine", amplitude = 0.1, angular_frequency_rad_per_s = 2.0, phase_rad = 0.3 })",
              R"({ kind = "bump", shape = "half_sine", height_m = 0.05, start_m = 0.5, length_m = 1 })")(),
      Contains("The profile has a kink at x = 0.5"));
  // A dip of radius 1/(0.05 22^2) = 0.04 m under one of 0.1 m.
  Problem sharp = problem_of(changed(changed(changed(changed(kWaves, "amplitude = 0.1", "amplitude = 0.05"),
                                                     "rad_per_s = 2.0", "rad_per_s = 22"),
                                             "phase_rad = 0.3", "phase_rad = -1.5707963"),
                                     "vx_m_per_s = 1.2", "vx_m_per_s = 0"),
                             {}, 1e-8);
  CHECK_THROWS_WITH(simulate(sharp, sharp.parameters.values()),
                    Contains("a dip of the profile that bends more than what touches it"));
}
