// A plate that slides on its feet in space, each with friction of its own in a direction of its own: by all
// formulations against differences of whole motions, and what is refused.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/plate_feet.h"
#include "property/ways_compared.h"
#include "support/with_words.h"

using namespace costate;
using costate::test::check_ways;
using costate::test::foot_of_plate;
using costate::test::MethodWay;
using costate::test::with_words;

namespace {

const std::vector<MethodWay> feet_ways = {{"index1", "cvodes-forward"},
                                          {"baumgarte", "idas-adjoint"},
                                          {"index2", "hand-adjoint"},
                                          {"maggi", "cvodes-adjoint"},
                                          {"maggi", "cvodes-forward"},
                                          {"maggi", "hand-tangent"},
                                          {"maggi", "hand-adjoint"},
                                          {"maggi", "discrete-tangent"},
                                          {"maggi", "discrete-adjoint"},
                                          {"maggi-implicit", "idas-adjoint"},
                                          {"maggi-implicit", "idas-forward"},
                                          {"maggi-implicit", "hand-tangent"},
                                          {"maggi-implicit", "hand-adjoint"},
                                          {"maggi-implicit", "discrete-adjoint"},
                                          {"maggi-second-order", "cvodes-adjoint"},
                                          {"maggi-second-order", "cvodes-forward"}};

const char* plate = R"(
[gravity]
z_m_per_s2 = -9.81
[rigid_body.plate]
x_m = 0
y_m = 0
z_m = 0.1
e0 = 0.9950041652780258
e1 = 0
e2 = 0
e3 = 0.09983341664682815
mass_kg = 2
inertia_xx_kg_m2 = 0.03
inertia_yy_kg_m2 = 0.05
inertia_zz_kg_m2 = 0.06
vx_m_per_s = 1.2
vy_m_per_s = 0.5
omega_z_rad_per_s = TURNS
[point.nail]
ground = true
x_m = 0.4
y_m = 0.3
z_m = 0.5
[spring.S]
from = "p0"
to = "nail"
stiffness_N_per_m = 12
natural_length_m = 0.3
[start]
given = ["plate.x", "plate.y", "plate.e3"]
given_velocities = ["plate.x", "plate.y", "plate.omega_z"]
[run]
t_end_s = END
rtol = 1e-11
formulation = "index1"
parameters = ["contact.c0.friction_coefficient", "rigid_body.plate.mass_kg", "rigid_body.plate.inertia_zz_kg_m2", "rigid_body.plate.vx_m_per_s", "rigid_body.plate.omega_z_rad_per_s", "point.p0.x_m", "point.p2.y_m", "spring.S.stiffness_N_per_m"]
[[cost.terminal]]
kind = "value"
output = "plate.x"
[[cost.terminal]]
kind = "value"
output = "plate.omega_z"
weight = 0.1
[[cost.terminal]]
kind = "value"
output = "lambda.contact.c0.across"
weight = 0.2
[[cost.running]]
kind = "square"
output = "lambda.contact.c1.along"
weight = 1e-2
[[cost.running]]
kind = "square"
output = "c2.normal_force"
weight = 1e-2
)";

Problem slide_plate(const std::vector<double>& frictions, double turns, double end) {
  const double places[4][2] = {{0.2, 0}, {-0.1, 0.15}, {-0.1, -0.15}, {-0.2, 0}};
  std::string scene = with_words(plate, {{"TURNS", fmt::format("{}", turns)}, {"END", fmt::format("{}", end)}});
  for (std::size_t i = 0; i < frictions.size(); ++i)
    scene += foot_of_plate(i, places[i][0], places[i][1], -0.1, frictions[i], "sliding = \"forward\"\n");
  return make_problem(Scene::parse(scene, "plate.toml"));
}

}  // namespace

// Velocities of feet depend on places, velocities, angles and the plate's own numbers, and so do directions of
// friction, in the motion and in what costs hold of it. Differences' own estimate is 1e-10; by these ways gradients at
// rtol 1e-11 are 3e-10 apart, taken tenfold.
TEST_CASE("feet in space: gradients of three that slide in directions of their own", "[events]") {
  Problem p = slide_plate({0.3, 0.2, 0.25}, 6, 0.2);
  check_ways(p, {}, feet_ways, 3e-9);
  p.objective.running.clear();  // of reactions
  check_ways(p, {}, {{"maggi", "hand-adjoint"}, {"maggi-second-order", "hand-adjoint"}}, 3e-9);
}

// One foot's weight is not determined beside three others', and turns the plate.
TEST_CASE("feet in space: Maggi's equations refuse a fourth that slides", "[events]") {
  Problem p = slide_plate({0.3, 0.3, 0.3, 0.3}, 0, 0.1);
  for (const char* formulation : {"maggi", "maggi-implicit", "maggi-second-order"}) {
    p.formulation = formulation;
    CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Catch::Contains("who bears how much of the weight"));
  }
}

// The feet of one body that turns about a third stop together whatever parameters do (needless_refusals.cpp); of two
// bodies that happen to, each by itself, either may be the first.
TEST_CASE("feet in space: two that stop at the same time by themselves have no gradient there") {
  const std::string text = R"toml([gravity]
z_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0
z_m = 0
vx_m_per_s = 1
vy_m_per_s = 0.5
[point.Q]
x_m = 0
y_m = 1
z_m = 0
vx_m_per_s = 1
vy_m_per_s = 0.5
[mass.P]
point = "P"
mass_kg = 2
[mass.Q]
point = "Q"
mass_kg = 2
[spring.s]
from = "P"
to = "Q"
stiffness_N_per_m = 10
natural_length_m = 1
[contact.p]
kind = "rigid"
point = "P"
friction = "coulomb"
friction_coefficient = 0.3
closed = true
sliding = "forward"
[contact.q]
kind = "rigid"
point = "Q"
friction = "coulomb"
friction_coefficient = 0.3
closed = true
sliding = "forward"
[start]
given = ["P.x", "P.y", "Q.x", "Q.y"]
[run]
t_end_s = 0.6
parameters = ["contact.p.friction_coefficient"]
[[cost.terminal]]
kind = "value"
output = "P.x"
)toml";
  Problem p = make_problem(Scene::parse(text, "two.toml"));
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  for (const char* method : {"discrete-adjoint", "discrete-tangent"})
    CHECK_THROWS_WITH(gradient(p, method, p.parameters.values()), Catch::Contains("stop sliding at the same time"));
}

// Who bears how much of the weight and of the friction is open; the box slides as a point: y = V t - x comes to
// y0 = mu m g/k at t1 = y0/V, then y = y0 + V/w sin(w s), s = t - t1, which stops and begins again at w s = 2 pi.
// States that guards are looked at cost a solution each: 204 a step before these were kept.
TEST_CASE("spatial feet: a box that is pulled on its four corners", "[events]") {
  std::string scene = R"toml([gravity]
z_m_per_s2 = -9.81
[rigid_body.box]
x_m = 0
y_m = 0
z_m = 0.1
mass_kg = 2
inertia_xx_kg_m2 = 0.03
inertia_yy_kg_m2 = 0.05
inertia_zz_kg_m2 = 0.06
[point.C]
on = "box"
x_m = 0
y_m = 0
z_m = 0
[force.pull]
point = "C"
k = 40
V = 0.7
formula_x_N = "k*(V*t-C.x)"
[start]
given = ["box.x", "box.y", "box.e3"]
given_velocities = []
[run]
t_end_s = 2
rtol = 1e-8
[[cost.terminal]]
kind = "value"
output = "box.x"
)toml";
  for (int i = 0; i < 4; ++i)
    scene += fmt::format(
        "[point.p{0}]\non = \"box\"\nx_m = {1}\ny_m = {2}\nz_m = -0.1\n[contact.c{0}]\nkind = \"rigid\"\n"
        "point = \"p{0}\"\nclosed = true\nfriction = \"coulomb\"\nfriction_coefficient = 0.3\n",
        i, i < 2 ? 0.2 : -0.2, i % 2 ? -0.15 : 0.15);
  Problem p = make_problem(Scene::parse(scene, "box.toml"));
  const double w = std::sqrt(40 / 2.0), y0 = 0.3 * 2 * 9.81 / 40, t1 = y0 / 0.7, s = 2 - t1,
               right = 0.7 * 2 - (y0 + 0.7 / w * std::sin(w * s));
  for (const char* formulation : {"index1", "baumgarte"}) {
    CAPTURE(formulation);
    p.formulation = formulation;
    const Simulation r = simulate(p, {});
    take_notices();
    CHECK(std::abs(r.psi - right) <= 2e-6);
    CHECK(r.counters.factorizations <= 30 * r.counters.steps);
  }
}
