// Contacts that close and open again within what would be one step: a wheel that spins freely over the ground, whose
// motion every integrator follows exactly by steps of any length, and a point of its rim that dips into the ground once
// a turn. With a stiffness that does next to nothing the motion stays that of the free wheel, and psi is known.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;
using Catch::Contains;
using Catch::Detail::Approx;

namespace {

// {0}: the contact, {1}: what else there is.
std::string wheel(const std::string& contact, const std::string& more = "") {
  return R"([body.wheel]
x_m = 0
y_m = 0.49
angle_rad = 0.3
angular_velocity_rad_per_s = 3
mass_kg = 1
inertia_kg_m2 = 0.1

[point.tip]
on = "wheel"
x_m = 0.5
y_m = 0

[start]
given = ["wheel.x", "wheel.y", "wheel.angle"]

[parameter.height]
number = "body.wheel.y_m"

[run]
t_end_s = 20
rtol = 1e-8

[[cost.running]]
kind = "value"
output = "floor.penetration"

[contact.floor]
)" + contact +
         "\n" + more;
}

constexpr const char* kPoint = "point = \"tip\"\nlaw = \"hertz\"\nstiffness_N_per_m_n = 1e-9\n";

std::string point(const std::string& more) { return fmt::format("{}{}", kPoint, more); }

// Nine dips by 20 s: psi = 9/3 int (r cos x - h) dx over |x| < w = acos(h/r), and dpsi/dh = -6 w.
const double kWidth = std::acos(0.98);
const double kDips = 3 * (std::sin(kWidth) - 0.98 * kWidth), kByHeight = -6 * kWidth;

Problem problem_of(const std::string& scene, const std::vector<std::string>& parameters = {}) {
  return make_problem(Scene::parse(scene, "wheel.toml"), parameters);
}

}  // namespace

TEST_CASE("brief touches: every formulation and integrator meets them", "[touch]") {
  // The absolute tolerance of psi is rtol m s. A dip has some ten steps between two kinks, each right to it: measured 2
  // to 33 rtol for nine dips.
  const auto formulation = GENERATE(as<std::string>(), "index1", "baumgarte", "penalty", "augmented-lagrangian",
                                    "index2", "index3", "maggi", "maggi-implicit");
  const auto integrator = GENERATE(as<std::string>(), "idas", "cvodes", "dopri5", "dop853");
  for (const double rtol : {1e-5, 1e-8}) {
    CAPTURE(formulation, integrator, rtol);
    Problem p = problem_of(wheel(kPoint));
    p.formulation = formulation;
    p.solver.integrator = integrator;
    p.solver.rtol = rtol;
    try {
      const Simulation run = simulate(p, p.parameters.values());
      CHECK(run.psi == Approx(kDips).margin(50 * rtol).epsilon(0));
      CHECK(run.counters.steps < 4000);
    } catch (const CapabilityError&) {  // of integrators that the formulation is not for
    }
  }
}

TEST_CASE("brief touches: whatever touches", "[touch]") {
  // A run whose steps are a fraction of a touch is the oracle.
  const std::string law = "law = \"hertz\"\nstiffness_N_per_m_n = 1e-9\n";
  struct Case {
    const char* name;
    std::string scene;
    double step;
  };
  const std::string flyers = R"([point.A]
x_m = -30
y_m = 0
vx_m_per_s = 3
[mass.A]
point = "A"
mass_kg = 1
[point.B]
x_m = 30
y_m = 0.15
vx_m_per_s = -3
[mass.B]
point = "B"
mass_kg = 1
[contact_pair.floor]
point = "A"
radius_m = 0.1
other = "B"
other_radius_m = 0.1
law = "hertz"
stiffness_N_per_m_n = 1e-9
[start]
given = ["A.x", "A.y", "B.x", "B.y"]
[[cost.running]]
kind = "value"
output = "floor.penetration"
[run]
t_end_s = 20
)";
  const std::string ceiling = R"([gravity]
y_m_per_s2 = -9.81
[point.A]
x_m = 0
y_m = 0
vy_m_per_s = 98.1
[mass.A]
point = "A"
mass_kg = 1
[contact.floor]
point = "A"
law = "hertz"
stiffness_N_per_m_n = 1e-9
ground_angle_rad = 3.141592653589793
ground_height_m = 490.49
[start]
given = ["A.x", "A.y"]
[[cost.running]]
kind = "value"
output = "floor.penetration"
[run]
t_end_s = 20
)";
  // {0}: mass and moments of inertia, {1}: what touches, {2}: what psi is of.
  const auto in_space = [](double mass, const std::string& what, const char* output) {
    return fmt::format(R"([gravity]
z_m_per_s2 = 0
[rigid_body.wheel]
x_m = 0
y_m = 0
z_m = 0.49
mass_kg = {0}
inertia_xx_kg_m2 = {0}
inertia_yy_kg_m2 = {0}
inertia_zz_kg_m2 = {0}
omega_y_rad_per_s = 3
[point.tip]
on = "wheel"
x_m = 0.4
y_m = 0
z_m = 0
{1}
[start]
given = ["wheel"]
[[cost.running]]
kind = "value"
output = "{2}"
[run]
t_end_s = 20
)",
                       mass, what, output);
  };
  const std::string sphere =
      in_space(1, "[contact.floor]\npoint = \"tip\"\nradius_m = 0.1\nlaw = \"hertz\"\nstiffness_N_per_m_n = 1e-9\n",
               "floor.penetration");
  // Of so much mass that a force of its deflection, in N and m, does nothing.
  const auto tyre = [&](const std::string& road, const std::string& more = "") {
    return in_space(1e12,
                    "[road.floor]\n" + road + "\n[tyre.T]\nwheel = \"tip\"\nroad = \"floor\"\nmodel = \"ride\"\n" +
                        "radius_m = 0.1\nstiffness_N_per_m = 1\n" + more,
                    "T.normal_force");
  };
  // Down to 0.01 m below the height at which it touches, at t = 10 s.
  std::string falling = tyre("kind = \"flat\"");
  for (const auto& [from, to] : {std::pair{"z_m_per_s2 = 0", "z_m_per_s2 = 9.81"},
                                 {"z_m = 0.49", "z_m = 490.59\nvz_m_per_s = -98.1"},
                                 {"omega_y_rad_per_s = 3", ""}})
    falling.replace(falling.find(from), std::strlen(from), to);
  const std::vector<Case> cases = {
      {"arc about a point of the rim", wheel("radius_m = 0.02\nground_height_m = -0.02\npoint = \"tip\"\n" + law),
       0.01},
      {"one of several points",
       wheel("points = [\"tip\", \"hub\"]\n" + law, "[point.hub]\non = \"wheel\"\nx_m = 0.1\ny_m = 0\n"), 0.01},
      {"a latched law", wheel("point = \"tip\"\nlaw = \"flores\"\nrestitution = 0.5\nstiffness_N_per_m_n = 1e-9\n"),
       0.01},
      {"with bristles", wheel(point("friction = \"dahl\"\nfriction_coefficient = 0.5\nbristle_stiffness_per_m = 10\n")),
       0.01},
      {"a ground that is carried",
       wheel(point("ground_body = \"base\"\n"),
             "[body.base]\nx_m = 0\ny_m = -0.005\nvy_m_per_s = 0.0005\nmass_kg = 1e3\ninertia_kg_m2 = 1e3\n"
             "angular_velocity_rad_per_s = 0.001\n"),
       0.01},
      {"a profile",
       wheel(point("road = \"hill\"\n"),
             "[road.hill]\nkind = \"profile\"\nlaw = { kind = \"sine\", amplitude = 0.003, "
             "angular_frequency_rad_per_s = 2.0 }\n"),
       0.01},
      {"a post",
       wheel(point("road = \"plate\"\n"),
             "[road.plate]\nkind = \"post\"\nlaw = { kind = \"sine\", amplitude = 0.003, "
             "angular_frequency_rad_per_s = 0.4 }\n"),
       0.01},
      {"a fixed circle",
       [&] {
         std::string scene = wheel("");
         scene.erase(scene.find("[contact.floor]"));
         return scene +
                "[point.stop]\nground = true\nx_m = 0\ny_m = -0.1\n[contact_pair.floor]\npoint = \"tip\"\nother "
                "= \"stop\"\nother_radius_m = 0.1\n" +
                law;
       }(),
       0.01},
      {"two that fly past each other", flyers, 0.005},
      {"a throw that reaches the ceiling", ceiling, 0.01},
      {"a sphere in space", sphere, 0.01},
      {"a tyre", tyre("kind = \"flat\""), 0.01},
      {"a tyre that comes down once", falling, 0.01},
      {"a tyre over a profile",
       tyre("kind = \"profile\"\nlaw = { kind = \"sine\", amplitude = 0.003, angular_frequency_rad_per_s = 2.0 }"),
       0.01},
      {"a tyre over a post",
       tyre("kind = \"post\"\nlaw = { kind = \"sine\", amplitude = 0.003, angular_frequency_rad_per_s = 0.4 }",
            "contact = \"vertical\"\n"),
       0.01},
  };
  // Steps of an eighth of a dip, h = w/12 s, over a kink of slope s = 0.3 m/s lose s h^2/12 m s at most: 7e-6 each, of
  // signs by chance, at eighteen kinks. A dip that is missed is 9e-4.
  constexpr double kKinks = 5e-5;
  for (const Case& c : cases) {
    Problem p = problem_of(c.scene);
    if (c.scene.find("\"base\"\n") != std::string::npos) {
      std::string scene = c.scene;
      const std::string given = "\"wheel.angle\"]";
      scene.replace(scene.find(given), given.size(), "\"wheel.angle\", \"base.x\", \"base.y\", \"base.angle\"]");
      p = problem_of(scene);
    }
    p.formulation = "index1";
    p.solver.rtol = 1e-8;
    p.solver.integrator = "dopri5";
    Problem fine = p;
    fine.solver.max_step_s = c.step / 10;
    const double oracle = simulate(fine, fine.parameters.values()).psi;
    CHECK(oracle > 1e-4);
    for (const char* integrator : {"idas", "cvodes", "dopri5", "dop853"}) {
      CAPTURE(c.name, integrator);
      p.solver.integrator = integrator;
      CHECK(simulate(p, p.parameters.values()).psi == Approx(oracle).margin(kKinks).epsilon(0));
    }
  }
}

TEST_CASE("brief touches: gradients meet them on the way back", "[touch]") {
  Problem p = problem_of(wheel(kPoint), {"body.wheel.y_m"});
  const auto rho = p.parameters.values();
  for (const char* formulation : {"index1", "baumgarte", "penalty", "index2"})
    for (const char* method : {"idas-adjoint", "idas-forward", "cvodes-adjoint", "cvodes-forward", "hand-tangent",
                               "hand-adjoint", "discrete-adjoint", "discrete-tangent"}) {
      CAPTURE(formulation, method);
      p.formulation = formulation;
      take_notices();
      try {
        const GradientResult r = gradient(p, method, rho);
        const bool told = !take_notices().empty();
        CHECK(r.psi == Approx(kDips).epsilon(1e-5));
        // The integrand jumps where a touch begins and ends, in the middle of a step of a discrete scheme: of eight
        // steps a dip half of one at each end, of signs by chance.
        const bool discrete = std::string(method).rfind("discrete", 0) == 0;
        CHECK(r.gradient[0] == Approx(kByHeight).epsilon(discrete ? 0.06 : 1e-4));
        CHECK((told || std::abs(r.gradient[0] - kByHeight) <= 1e-4 * std::abs(kByHeight)));
      } catch (const CapabilityError&) {
      }
    }
}

TEST_CASE("brief touches: impacts", "[touch]") {
  const double first = (4 * std::atan(1.0) + std::asin(0.98) - 0.3) / 3;
  for (const char* formulation : {"index1", "baumgarte", "penalty", "index2", "index3"})
    for (const char* integrator : {"idas", "cvodes", "dopri5"}) {
      CAPTURE(formulation, integrator);
      Problem p = problem_of(wheel("kind = \"rigid\"\npoint = \"tip\"\nrestitution = 0.5\n"));
      p.formulation = formulation;
      p.solver.integrator = integrator;
      p.solver.t_end = 2;
      try {
        const auto run = simulate(p, p.parameters.values());
        REQUIRE(!run.events.empty());
        // The motion until then is exact.
        CHECK(run.events[0].t == Approx(first).epsilon(1e-9));
      } catch (const CapabilityError&) {
      }
    }
}

TEST_CASE("brief touches: fixed steps that pass over one say so", "[touch]") {
  Problem p = problem_of(wheel(kPoint));
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  p.solver.step_s = 0.4;
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()),
                    Contains("passes over a touch: contact.floor is closed from") && Contains("--step"));
  p.solver.step_s = 0.01;
  CHECK(simulate(p, p.parameters.values()).psi == Approx(kDips).epsilon(0.02));
}

TEST_CASE("brief touches: what never touches costs no steps", "[touch]") {
  // The rim comes as near as a millimetre.
  const auto steps = [](double height) {
    Problem p = problem_of(wheel(point(fmt::format("ground_height_m = {}\n", height))));
    p.formulation = "index1";
    p.solver.integrator = "cvodes";
    const auto run = simulate(p, p.parameters.values());
    CHECK(run.psi == 0);
    return run.counters.steps;
  };
  CHECK(steps(-0.011) == steps(-50));
}

// Where a gap cannot close within a step nothing is looked at within it: with Maggi's formulation every look solves for
// the dependent coordinates.
TEST_CASE("contact out of reach: no evaluation and hardly a factorization more", "[touch]") {
  // Of one tolerance a count by step is known to some percent, of nine together to a part of one.
  struct Count {
    double steps = 0, residuals = 0, factorizations = 0;
    bool events = false;
  };
  const auto run = [](const char* formulation, const std::string& contact) {
    std::vector<std::string> set;
    if (!contact.empty())
      set.push_back(
          fmt::format("contact.far={{point=\"P2\",stiffness_N_per_m_n=1e5,ground_height_m=-50,{}}}", contact));
    Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar.toml", set));
    p.formulation = formulation;
    p.solver.t_end = 20;
    Count sum;
    for (int k = -4; k <= 4; ++k) {
      p.solver.rtol = 1e-7 * std::pow(1.2, k);
      const Simulation one = simulate(p, p.parameters.values());
      sum.steps += static_cast<double>(one.counters.steps);
      sum.residuals += static_cast<double>(one.counters.residuals);
      sum.factorizations += static_cast<double>(one.counters.factorizations);
      sum.events = sum.events || !one.events.empty();
    }
    return sum;
  };
  for (const char* formulation : {"index1", "maggi"}) {
    const Count without = run(formulation, "");
    // A rigid contact that can close has a row more; this one bounces for good.
    for (const char* contact :
         {"law=\"hertz\"", "restitution=0.5", "kind=\"rigid\",restitution=0.5,closing_speed_m_per_s=0"}) {
      CAPTURE(formulation, contact);
      const Count with = run(formulation, contact);
      CHECK(!with.events);
      // A latched speed is an unknown more in the integrators' norms, by which steps and their iterations differ.
      const bool latched = std::string(contact) == "restitution=0.5";
      if (!latched) CHECK(with.residuals == without.residuals);
      CHECK(with.residuals / with.steps < 1.02 * without.residuals / without.steps);
      // IDAS factors once in a hundred steps; Maggi's looks would once a look.
      CHECK(with.factorizations / with.steps < 1.01 * without.factorizations / without.steps + 0.002);
    }
  }
}

TEST_CASE("brief touches: looks within steps do not have Maggi's branch judged over many of them", "[touch]") {
  // Behind the bumps the wheels of the Iltis swing near the road, and most steps are looked at in their middle. At one
  // in seven tolerances the motion was said to have left its branch.
  for (const double rtol : {5e-11, 7e-11, 1e-10, 1e-9}) {
    Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/iltis/speed_bumps.toml"));
    p.formulation = "maggi";
    p.solver.integrator = "cvodes";
    p.solver.rtol = rtol;
    CAPTURE(rtol);
    // 12.446869, by maggi on dopri5 at rtol 1e-10.
    CHECK(simulate(p, p.parameters.values()).psi == Approx(12.446869).epsilon(2e-6));
  }
}
