// Rigid contacts of bodies in space without friction: a bounce and a rest against closed forms.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/falling_box.h"
#include "property/ways_compared.h"

using namespace costate;
using costate::test::event_names;
using costate::test::kFallingBox;

// It falls without turning by h = 0.5 m; the impulse p = (1 + e) v/(1/m + y^2/Jx + x^2/Jy) of the floor at the corner's
// (x, y) from the centre then throws the centre up by p/m - v. All is quadratic in time but the turning, of which the
// cost has nothing: times are off by the tolerance 1e-11, taken hundredfold in the derivatives. Open, no row of the
// contact is there, but penalty holds |e| = 1 by 1/alpha alone, which is 2e-8 of the derivative by the inertia.
TEST_CASE("rigid contacts in space: the corner of a box bounces", "[events]") {
  const double g = 9.81, e = 0.6, m = 1.4, Jx = 0.03, Jy = 0.05, x = 0.1, y = 0.2, end = 0.5, h = 0.5;
  const double v = std::sqrt(2 * h * g), t = v / g, W = 1 / m + y * y / Jx + x * x / Jy, p = (1 + e) * v / W;
  const double left = end - t, z = 0.2 + (p / m - v) * left - 0.5 * g * left * left;
  const double by_e = v / W / m * left;
  const double by_m = left * (-p / (m * m) + p / W / (m * m) / m);
  const double by_Jx = left * p / W * y * y / (Jx * Jx) / m;
  // dv = g dt, dt = dh/v: the start moves the touch.
  const double by_h = (p / m / v - 1) * g / v * left - (p / m - v) / v + g * left / v;
  const std::pair<const char*, const char*> ways[] = {{"index1", "idas-adjoint"},      {"index1", "cvodes-forward"},
                                                      {"index2", "idas-adjoint"},      {"baumgarte", "idas-forward"},
                                                      {"baumgarte", "cvodes-adjoint"}, {"maggi", "cvodes-adjoint"},
                                                      {"penalty", "cvodes-adjoint"}};
  for (const auto& [formulation, method] : ways) {
    Problem problem = make_problem(Scene::parse(kFallingBox, "falling.toml"));
    problem.formulation = formulation;
    const GradientResult r = gradient(problem, method, problem.parameters.values());
    CAPTURE(formulation, method);
    REQUIRE(event_names(r.events) == std::vector<std::string>{"contact.floor: touch bounces"});
    CHECK(std::abs(r.events[0].t - t) <= 1e-10);
    CHECK(std::abs(r.psi - z) <= 1e-9);
    CHECK(std::abs(r.gradient[0] - by_e) <= 1e-9);
    CHECK(std::abs(r.gradient[1] - by_m) <= 1e-9);
    CHECK(std::abs(r.gradient[2] - by_Jx) <= (formulation == std::string("penalty") ? 1e-7 : 1e-8));
    CHECK(std::abs(r.gradient[3] - by_h) <= 1e-8);
  }
}

// A plate falls askew onto three feet about its centre, one after the other, and rests: its height is that of the feet,
// 0.05 m, and each bears m g/3; by how high it started nothing changes. Runs at rtol 1e-10, taken tenfold.
TEST_CASE("rigid contacts in space: a plate comes to rest on three feet", "[events]") {
  std::string scene = R"(
[gravity]
z_m_per_s2 = -9.81
[rigid_body.plate]
x_m = 0
y_m = 0
z_m = 0.3
e0 = 0.998299
e1 = 0.05
e2 = 0.03
e3 = 0
mass_kg = 2
inertia_xx_kg_m2 = 0.02
inertia_yy_kg_m2 = 0.03
inertia_zz_kg_m2 = 0.04
[start]
given = ["plate"]
[run]
t_end_s = 1
rtol = 1e-10
formulation = "index1"
parameters = ["rigid_body.plate.mass_kg", "rigid_body.plate.z_m"]
[[cost.terminal]]
kind = "value"
output = "plate.z"
[[cost.terminal]]
kind = "value"
output = "c0.normal_force"
weight = 0.01
)";
  const double feet[3][2] = {{0.2, 0}, {-0.1, 0.17}, {-0.1, -0.17}};
  for (int i = 0; i < 3; ++i)
    scene += fmt::format(
        "[point.p{0}]\non = \"plate\"\nx_m = {1}\ny_m = {2}\nz_m = -0.05\n"
        "[contact.c{0}]\nkind = \"rigid\"\npoint = \"p{0}\"\nrestitution = 0\n",
        i, feet[i][0], feet[i][1]);
  for (const auto& [formulation, method] : {std::pair{"index1", "idas-adjoint"},
                                            {"index1", "cvodes-forward"},
                                            {"index2", "idas-forward"},
                                            {"baumgarte", "cvodes-adjoint"},
                                            {"maggi", "cvodes-adjoint"},
                                            {"maggi-implicit", "idas-forward"}}) {
    Problem p = make_problem(Scene::parse(scene, "plate.toml"));
    p.formulation = formulation;
    const GradientResult r = gradient(p, method, p.parameters.values());
    CAPTURE(formulation, method);
    CHECK(event_names(r.events) ==
          std::vector<std::string>{"contact.c0: touch closed", "contact.c2: touch closed", "contact.c1: touch closed"});
    CHECK(std::abs(r.psi - (0.05 + 0.01 * 2 * 9.81 / 3)) <= 1e-9);
    CHECK(std::abs(r.gradient[0] - 0.01 * 9.81 / 3) <= 1e-9);
    CHECK(std::abs(r.gradient[1]) <= 1e-8);
  }
}
