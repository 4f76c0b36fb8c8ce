// Stiff motions on CVODES: Adams' method is left for BDF, with a word, or the run ends early with the cause.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Contains;
using Catch::Detail::Approx;

namespace {

/// A double pendulum of two bars whose end hangs on a spring and damper.
Problem pendulum(double mass_kg, double damping) {
  Problem p = make_problem(Scene::parse(fmt::format(R"([gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.6
y_m = -0.8
[point.Q]
x_m = 1.4
y_m = -1.4
[point.W]
ground = true
x_m = 1.5
y_m = 0.5
[bar.r1]
from = "A"
to = "P"
mass_kg = 1
length_m = 1
[bar.r2]
from = "P"
to = "Q"
mass_kg = {}
length_m = 1
[spring.s]
from = "Q"
to = "W"
stiffness_N_per_m = 100
natural_length_m = 1
damping_N_s_per_m = {}
[start]
given = ["P.x", "Q.x"]
[[cost.running]]
kind = "square"
output = "P.x"
[parameter.m1]
number = "bar.r1.mass_kg"
[run]
t_end_s = 1
parameters = ["m1"]
)",
                                                    mass_kg, damping),
                                        "s.toml"));
  p.formulation = "baumgarte";
  return p;
}

Simulation run(Problem p, const std::string& integrator) {
  p.solver.integrator = integrator;
  take_notices();
  return simulate(p, p.parameters.values());
}

bool said_stiff() {
  for (const auto& text : take_notices())
    if (Contains("The motion is stiff").match(text)) return true;
  return false;
}

}  // namespace

TEST_CASE("stiffness: a stiff damper is run by BDF, which is said") {
  const Problem p = pendulum(1, 1e12);
  const Simulation right = run(p, "idas");
  CHECK_FALSE(said_stiff());
  const Simulation r = run(p, "cvodes");
  CHECK(said_stiff());
  CHECK(r.counters.steps < 10'000);
  // The damper holds Q almost on a circle; each run is good to some 1e3 steps at rtol 1e-8.
  CHECK(r.psi == Approx(right.psi).epsilon(1e-5));
}

TEST_CASE("stiffness: a motion that is not stiff stays with Adams' method") {
  run(pendulum(1, 1), "cvodes");
  CHECK_FALSE(said_stiff());
}

TEST_CASE("stiffness: a light mass that keeps swinging fast ends early with the cause") {
  // Its frequency is that of 100 N/m on 1e-12 kg, 1e7 1/s: whoever follows it takes millions of steps.
  CHECK_THROWS_WITH(run(pendulum(1e-12, 1), "cvodes"), Contains("very stiff elements") || Contains("is stiff"));
}
