// Contacts in space whose friction falls as sliding begins: along the acceleration that is left, which is not the way
// of the friction that held. Against programs of scipy (DOP853 at 1e-12, which begin with w = a d behind the instant
// that brentq finds, d = 1e-7 s, and stop at 2e-7 m/s; derivatives by Richardson's differences of them), and whole
// motions.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "property/ways_compared.h"
#include "support/with_words.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

namespace {

const std::vector<MethodWay> ways_in_space = {
    {"index1", "idas-adjoint"},     {"index1", "idas-forward"},     {"index1", "cvodes-adjoint"},
    {"index1", "cvodes-forward"},   {"index1", "hand-tangent"},     {"baumgarte", "hand-adjoint"},
    {"baumgarte", "idas-adjoint"},  {"penalty", "cvodes-adjoint"},  {"index2", "hand-adjoint"},
    {"index2", "discrete-tangent"}, {"index2", "discrete-adjoint"}, {"index3", "idas-adjoint"},
    {"maggi", "hand-adjoint"},      {"maggi", "cvodes-forward"},    {"maggi-implicit", "discrete-adjoint"}};

/// What pulls the point PULLED: a spring whose other end goes along a curve.
const char* const kPull = R"toml([force.pull]
point = "PULLED"
k = 40
V = 0.3
W = 0.25
formula_x_N = "k*(V*t - PULLED.x)"
formula_y_N = "k*(W*sin(1.3*t) - PULLED.y)"
[[cost.terminal]]
kind = "value"
output = "PULLED.x"
[[cost.terminal]]
kind = "value"
output = "PULLED.y"
weight = 2
[gravity]
z_m_per_s2 = -9.81
)toml";

const char* const kPoint = R"([point.P]
x_m = 0
y_m = 0
z_m = 0
[mass.P]
point = "P"
mass_kg = 2
[contact.floor]
kind = "rigid"
point = "P"
closed = true
along_m = 0
across_m = 0
friction = "coulomb"
friction_coefficient = 0.3
static_coefficient = 0.5
[start]
given = []
[run]
t_end_s = 6
rtol = 1e-10
formulation = "index1"
parameters = ["contact.floor.friction_coefficient", "contact.floor.static_coefficient", "mass.P.mass_kg", "force.pull.k", "force.pull.V", "force.pull.W"]
)";

Problem pulled_point() {
  return make_problem(Scene::parse(with_words(kPull, {{"PULLED", "P"}}) + kPoint, "pulled.toml"));
}

/// One that rolls until its friction would be more than that of sticking: 0.1 m, 1.5 kg, I = 0.006 kg m^2.
const char* const kBall = R"toml([gravity]
z_m_per_s2 = -9.81
[rigid_body.ball]
mass_kg = 1.5
inertia_xx_kg_m2 = 0.006
inertia_yy_kg_m2 = 0.006
inertia_zz_kg_m2 = 0.006
x_m = 0
y_m = 0
z_m = 0.1
[point.C]
on = "ball"
x_m = 0
y_m = 0
z_m = 0
[contact.floor]
kind = "rigid"
point = "C"
radius_m = 0.1
closed = true
friction = "coulomb"
friction_coefficient = 0.25
static_coefficient = 0.4
[force.pull]
point = "C"
A = 35
w = 2.5
B = 6
formula_x_N = "A*sin(w*t)"
formula_y_N = "B*cos(3*t)"
[start]
given = ["ball.x", "ball.y", "ball.orientation"]
given_velocities = ["ball.orientation"]
[run]
t_end_s = 3
rtol = 1e-9
formulation = "index1"
parameters = ["contact.floor.friction_coefficient", "contact.floor.static_coefficient", "force.pull.A", "force.pull.w", "force.pull.B"]
[[cost.terminal]]
kind = "value"
output = "ball.x"
[[cost.terminal]]
kind = "value"
output = "ball.y"
weight = 2
)toml";

/// A point on a slope that carries another one on a rod, so that it is no lighter than along the rod.
const char* const kLinked = R"([gravity]
z_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0
z_m = 0
[mass.P]
point = "P"
mass_kg = 1
[point.Q]
x_m = 0.6
y_m = 0.3
z_m = 0.5
vx_m_per_s = -0.5
vy_m_per_s = 1
vz_m_per_s = 0
[mass.Q]
point = "Q"
mass_kg = 0.8
[distance.rod]
from = "P"
to = "Q"
[contact.floor]
kind = "rigid"
point = "P"
closed = true
along_m = 0
across_m = 0
ground_angle_rad = 0.1
friction = "coulomb"
friction_coefficient = 0.1
static_coefficient = 0.25
[point.N]
ground = true
x_m = 0.5
y_m = 0
z_m = 1.2
[spring.hang]
from = "N"
to = "Q"
stiffness_N_per_m = 20
natural_length_m = 0.5
[start]
given = ["Q.x", "Q.y"]
given_velocities = ["Q.x", "Q.y"]
[run]
t_end_s = 2
rtol = 1e-10
formulation = "index1"
parameters = ["contact.floor.friction_coefficient", "contact.floor.static_coefficient", "mass.P.mass_kg", "mass.Q.mass_kg", "spring.hang.stiffness_N_per_m"]
[[cost.terminal]]
kind = "value"
output = "P.x"
[[cost.terminal]]
kind = "value"
output = "Q.y"
weight = 2
[[cost.running]]
kind = "square"
output = "floor.friction_force"
weight = 0.01
)";

/// A box on so many feet, up to four, pulled below its middle.
Problem box(std::size_t feet) {
  std::string scene = with_words(kPull, {{"PULLED", "H"}, {"0.25", "0.9"}, {"0.3", "0.7"}}) + R"([rigid_body.box]
mass_kg = 2
inertia_xx_kg_m2 = 0.05
inertia_yy_kg_m2 = 0.06
inertia_zz_kg_m2 = 0.07
x_m = 0
y_m = 0
z_m = 0.2
[point.H]
on = "box"
x_m = 0
y_m = 0
z_m = -0.1
[start]
given = ["box.x", "box.y", "box.e3"]
given_velocities = []
)";
  const char* const places[] = {"-0.3\ny_m = -0.2", "0.3\ny_m = -0.2", "0\ny_m = 0.4", "0.1\ny_m = 0.1"};
  std::string sliding, sticking;
  for (std::size_t i = 0; i < feet; ++i) {
    const std::string foot = fmt::format("foot_{}", i);
    scene += fmt::format(
        "[point.{0}]\non = \"box\"\nx_m = {1}\nz_m = -0.2\n[contact.{0}]\nkind = \"rigid\"\npoint = \"{0}\"\n"
        "closed = true\nfriction = \"coulomb\"\nfriction_coefficient = 0.3\nstatic_coefficient = 0.5\n",
        foot, places[i]);
    sliding += fmt::format("\"contact.{}.friction_coefficient\", ", foot);
    sticking += fmt::format("\"contact.{}.static_coefficient\", ", foot);
  }
  scene += fmt::format(
      "[run]\nt_end_s = 0.5\nrtol = 1e-10\nformulation = \"index1\"\n"
      "parameters = [\"mu\", \"mu_s\", \"force.pull.V\"]\n"
      "[parameter.mu]\nnumbers = [{}]\n[parameter.mu_s]\nnumbers = [{}]\n",
      sliding, sticking);
  return make_problem(Scene::parse(scene, "box.toml"));
}

/// By all of `ways`, to `allowed` of psi and of the largest scaled component; soft constraints cost 1/alpha.
void check_against(const Problem& p, double psi, const std::vector<double>& right, const std::vector<MethodWay>& ways,
                   double allowed, std::size_t events) {
  check_gradients(p, right, ways, allowed, 1e-6, [&](const GradientResult& r, double own) {
    CHECK(r.events.size() == events);
    CHECK(std::abs(r.psi - psi) <= own * std::abs(psi));
  });
}

}  // namespace

// Three times it begins to slide (0.583136078, 1.990899696, 3.698967691 s), and stops in between (1.577815529,
// 3.037949381). Three thousand times the tolerance: three slips add up, each of which multiplies by what its instant
// depends on (index2 by hand-adjoint: 1,100).
TEST_CASE("static friction in space: a pulled point sticks and slips", "[events]") {
  const std::vector<double> times = {0.5831360783230023, 1.577815528655255, 1.9908996956835083, 3.0379493814075667,
                                     3.6989676911620344};
  const Problem p = pulled_point();
  const auto r = simulate(p, p.parameters.values());
  REQUIRE(r.events.size() == times.size());
  for (std::size_t i = 0; i < times.size(); ++i) CHECK(std::abs(r.events[i].t - times[i]) <= 6e-7);
  check_against(p, 2.1694761846, {-1.57622244, 1.36456292, 0.41786748, -0.020893374, 5.85937746, 0.80899288},
                ways_in_space, 3e-7, 5);
}

// Up to 5.9 N of friction let it roll, then 3.7 N are left: accelerations jump, into a direction that has to be found.
TEST_CASE("static friction in space: a ball rolls until it slides", "[events]") {
  check_against(make_problem(Scene::parse(kBall, "ball.toml")), 19.2568997905,
                {-7.51804935, -2.12552592, 0.59564030, -8.53679949, 0.18986865},
                {{"index1", "cvodes-forward"},
                 {"baumgarte", "hand-adjoint"},
                 {"baumgarte", "idas-adjoint"},
                 {"index2", "discrete-adjoint"}},
                1e-6, 1);
}

TEST_CASE("static friction in space: what else holds the body turns the way of the slip", "[events]") {
  check_ways(make_problem(Scene::parse(kLinked, "linked.toml")),
             {"contact.floor: slip slides", "contact.floor: stop sticks"}, ways_in_space, 1e-7, 1e-6);
}

// As long as any shares of the friction are within all limits of sticking; then all feet fall to that of sliding in one
// instant, 0.181106430 s, at which sqrt(V^2 t^2 + W^2 sin^2(1.3 t)) k is mu_s m g.
TEST_CASE("static friction in space: the feet of one body", "[events]") {
  const Problem p = box(3);
  const GradientResult right = gradient(p, "differences", p.parameters.values());
  // Which of them is named is chance.
  CHECK(right.events.size() == 1);
  CHECK(std::abs(right.events.front().t - 0.18110642950174163) <= 1e-8);
  check_against(p, right.psi, right.gradient,
                {{"index1", "cvodes-forward"}, {"baumgarte", "idas-adjoint"}, {"maggi", "hand-adjoint"}}, 1e-7, 1);
  // Of four that turn who bears how much decides.
  const Problem four = box(4);
  CHECK_THROWS_WITH(simulate(four, four.parameters.values()), Contains("who bears how much of their weight"));
}

// Straight across: k W sin(1.3 t) = mu_s m g.
TEST_CASE("static friction in space: across the first direction of the ground", "[events]") {
  const Problem p = pulled_point();
  std::vector<double> rho = p.parameters.values();
  rho[4] = 0;    // V
  rho[5] = 0.6;  // W
  const auto r = simulate(p, rho);
  REQUIRE(!r.events.empty());
  CHECK(r.events.front().name == "contact.floor: slip");
  CHECK(std::abs(r.events.front().t - std::asin(0.5 * 2 * 9.81 / (40 * 0.6)) / 1.3) <= 1e-8);
}

TEST_CASE("static friction in space: what is not carried is refused by name", "[events]") {
  Problem p = pulled_point();
  CHECK_THROWS_WITH(hessian(p, p.parameters.values()), Contains("begin from rest, in a direction that it decides"));
  CHECK_THROWS_WITH(gradient(p, "discrete-tangent", p.parameters.values()), Contains("explicit steps do not carry"));
  p.solver.integrator = "fixed";
  p.solver.step_s = 0.01;
  p.formulation = "index3";
  CHECK_THROWS_WITH(gradient(p, "discrete-adjoint", p.parameters.values()), Contains("the fall of its friction"));
}
