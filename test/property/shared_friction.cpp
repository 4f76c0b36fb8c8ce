// Friction that several contacts share, each with a static coefficient above that of sliding: whether the sum that is
// left to their limits is determined. Feet of one body are in static_friction.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <tuple>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;
using Catch::Contains;

// Two blocks that a spring presses to a floor and to a ceiling, whose direction along is the other one, and that a
// driver keeps together: 2 (100 N/m 0.2 m) press, and k (V t1) = mu_s 40 N. By penalty, which carries such rows of two
// bodies.
TEST_CASE("shared friction: of contacts whose directions along the ground oppose each other", "[events]") {
  Problem p = make_problem(Scene::parse(R"toml([gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0
[mass.P]
point = "P"
mass_kg = 1
[point.Q]
x_m = 0
y_m = 1
[mass.Q]
point = "Q"
mass_kg = 1
[spring.s]
from = "P"
to = "Q"
natural_length_m = 1.2
stiffness_N_per_m = 100
[driver.together]
coordinates = ["P.x", "Q.x"]
weights = [1, -1]
law = { kind = "constant", value = 0 }
[contact.floor]
kind = "rigid"
point = "P"
closed = true
friction = "coulomb"
friction_coefficient = 0.3
static_coefficient = 0.5
[contact.ceiling]
kind = "rigid"
point = "Q"
closed = true
friction = "coulomb"
friction_coefficient = 0.3
static_coefficient = 0.5
ground_angle_rad = 3.141592653589793
ground_height_m = 1
[force.pull]
point = "P"
k = 40
V = 0.7
formula_x_N = "k*(V*t - P.x)"
[start]
given = ["P.x"]
given_velocities = []
[run]
t_end_s = 3
rtol = 1e-10
parameters = ["mu_s"]
[parameter.mu_s]
numbers = ["contact.floor.static_coefficient", "contact.ceiling.static_coefficient"]
[[cost.terminal]]
kind = "value"
output = "P.x"
)toml",
                                        "clamp.toml"));
  p.formulation = "penalty";
  // By scipy's DOP853 of a point pressed by 40 N, and central differences of it.
  for (const char* method : {"idas-adjoint", "cvodes-forward", "discrete-adjoint"}) {
    CAPTURE(method);
    const GradientResult r = gradient(p, method, p.parameters.values());
    REQUIRE(r.events.size() == 3);
    CHECK(std::abs(r.events[0].t - 20.0 / 28) <= 1e-7);
    CHECK(std::abs(r.psi - 2.00833441) <= 1e-6);
    CHECK(std::abs(r.gradient[0] + 1.08042203) <= 1e-5);
  }
}

TEST_CASE("shared friction: what slopes that face each other leave open is refused", "[events]") {
  // A body in a groove between two slopes, pulled across: what one takes by friction the other takes by pressure, and
  // what is left to both limits is not determined.
  std::string groove = R"toml([gravity]
y_m_per_s2 = -9.81
[body.b]
mass_kg = 2
inertia_kg_m2 = 0.1
x_m = 0
y_m = 0.3268379
[point.C]
on = "b"
x_m = 0
y_m = 0
[force.pull]
point = "C"
formula_x_N = "10*t"
[start]
given = ["b.angle"]
given_velocities = []
[run]
t_end_s = 3
[[cost.terminal]]
kind = "value"
output = "b.x"
)toml";
  for (const auto& [foot, x, slope] : {std::tuple{"left", -0.3, -0.4}, {"right", 0.3, 0.4}})
    groove += fmt::format(
        "[point.{0}]\non = \"b\"\nx_m = {1}\ny_m = -0.2\n[contact.{0}]\nkind = \"rigid\"\npoint = \"{0}\"\n"
        "closed = true\nfriction = \"coulomb\"\nfriction_coefficient = 0.3\nstatic_coefficient = 0.6\n"
        "ground_angle_rad = {2}\n",
        foot, x, slope);
  const Problem p = make_problem(Scene::parse(groove, "groove.toml"));
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()),
                    Contains("other contacts hold its body") && Contains("contact.left"));
}

// The least norm of four shares of the weight pulls at the first foot, though the others can bear all of it.
TEST_CASE("shared friction: a foot that would be pulled by the least norm is told what that is", "[events]") {
  std::string box = R"toml([gravity]
y_m_per_s2 = -9.81
[body.box]
x_m = 0
y_m = 0.2
mass_kg = 2
inertia_kg_m2 = 0.1
[start]
given = ["box.x"]
given_velocities = []
[run]
t_end_s = 0.1
)toml";
  for (const auto& [foot, x] : {std::pair{"f0", -0.8}, {"f1", -0.35}, {"f2", -0.3}, {"f3", 0.03}})
    box += fmt::format(
        "[point.{0}]\non = \"box\"\nx_m = {1}\ny_m = -0.2\n[contact.{0}]\nkind = \"rigid\"\npoint = \"{0}\"\n"
        "friction = \"coulomb\"\nfriction_coefficient = 0.3\nclosed = true\n",
        foot, x);
  const Problem p = make_problem(Scene::parse(box, "box.toml"));
  CHECK_THROWS_WITH(simulate(p, {}), Contains("'contact.f0: release' has happened already") &&
                                         Contains("Who of 4 bears how much") &&
                                         !Contains("same share of its friction"));
}

// Bounces against the wall die out at 0.4725 s, and what the feet have then of speed is errors: taken for sliding,
// their friction pushed the box to the wall, and let it go at 0.864 s (psi 1.80389 at all tolerances of Baumgarte's).
// By statics it begins to slide where |p_x| reaches mu_l N_l + mu_r N_r of sticking, at 0.9770259 s (the sum of what
// both feet bear about the box's middle, by scipy's brentq).
TEST_CASE("shared friction: a box that has come to rest at a wall sticks", "[events]") {
  for (const char* formulation : {"maggi", "index1", "index2", "baumgarte"})
    for (const double rtol : {1e-8, 1e-9}) {
      CAPTURE(formulation, rtol);
      Problem p = problem_of_case("box_at_wall");
      p.formulation = formulation;
      p.solver.rtol = rtol;
      p.solver.confirm = false;
      try {
        const auto r = simulate(p, p.parameters.values());
        CHECK(std::abs(r.psi - 1.7874968) <= 3e-6);
        const auto slip = std::find_if(r.events.begin(), r.events.end(), [](const RunEvent& e) { return e.t > 0.9; });
        REQUIRE(slip != r.events.end());
        CHECK(slip->name == "contact.l: slip");
        CHECK(std::abs(slip->t - 0.9770259) <= 1e-6);
      } catch (const CapabilityError& e) {  // by the shares that Baumgarte's rows have one foot is at its limit
        CHECK(std::string(formulation) == "baumgarte");
        CHECK_THAT(e.what(), Contains("who bears how much is not determined"));
      }
    }
}
