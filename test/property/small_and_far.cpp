// What is small beside how far it goes, by Maggi's formulations: a way counts by branches of positions, which contacts
// alone have none of.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

using namespace costate;

namespace {

void check(const char* scene, double psi) {
  Problem p = make_problem(Scene::parse(scene, "small.toml"));
  for (const char* formulation : {"maggi", "maggi-second-order", "maggi-implicit"}) {
    p.formulation = formulation;
    p.solver.integrator.clear();
    CAPTURE(formulation);
    const Simulation s = simulate(p, p.parameters.values());
    CHECK(s.psi == Approx(psi).epsilon(1e-6));
    // A few at each of the looks at events: four a step, and some fifty at an event.
    CHECK(s.counters.factorizations < 30 * s.counters.steps + 1000);
    take_notices();
  }
}

}  // namespace

// 5 million factorizations of 19 steps: positions were followed in parts of the disc's size.
TEST_CASE("maggi: a small disc slides until it rolls", "[maggi]") {
  // It rolls from t = v/(3 mu g) on, at two thirds of its speed.
  const double slides = 1 / (3 * 0.3 * 9.81), psi = slides - 0.15 * 9.81 * slides * slides + (0.5 - slides) * 2 / 3;
  check(R"toml(
[gravity]
y_m_per_s2 = -9.81
[body.d]
x_m = 0
y_m = 1e-4
vx_m_per_s = 1
mass_kg = 1
inertia_kg_m2 = 5e-9
[point.c]
on = "d"
x_m = 0
y_m = 0
[contact.f]
kind = "rigid"
point = "c"
radius_m = 1e-4
friction = "coulomb"
friction_coefficient = 0.3
sliding = "forward"
closed = true
[start]
given = ["d.x", "d.angle"]
[run]
t_end_s = 0.5
parameters = ["contact.f.friction_coefficient"]
[[cost.terminal]]
kind = "value"
output = "d.x"
)toml",
        psi);
}

// 100,000 a step, or no end: the height that it begins at was the size of the mechanism.
TEST_CASE("maggi: an impact right behind the start", "[maggi]") {
  // y' = 0.8 - 10 t behind it: y'(0.1) and the integral of its square.
  check(R"toml(
[gravity]
y_m_per_s2 = -10
[point.P]
x_m = 0
y_m = 1e-14
vy_m_per_s = -1
[mass.m]
point = "P"
mass_kg = 1
[contact.c]
point = "P"
kind = "rigid"
restitution = 0.8
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 0.1
rtol = 1e-9
parameters = ["point.P.vy_m_per_s"]
[[cost.terminal]]
kind = "value"
output = "P.y_dot"
[[cost.running]]
kind = "square"
output = "P.y_dot"
)toml",
        -0.2 + 0.064 - 0.08 + 0.1 / 3);
}
