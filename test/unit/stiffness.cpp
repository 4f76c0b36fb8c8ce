// Stiff motions on CVODES: Adams' method is left for BDF, with a word, or the run ends early with the cause.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/pace_watch.h"
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

TEST_CASE("stiffness: a pace that goes up and down is as hopeless as a steady one, one that grows is not") {
  const auto steps_until_told = [](const auto& length) -> long {
    PaceWatch watch;
    double t = 0;
    for (long steps = 0; steps < 100000; ++steps) {
      if (watch.projected(t, steps, 1, 1000000) > 0) return steps;
      t += length(steps);
    }
    return -1;
  };
  const auto steady = [](long) { return 1e-12; };
  const auto up_and_down = [](long k) { return k / 250 % 3 == 0 ? 2e-12 : 1e-12; };
  // Thrice as fast every thousand steps.
  const auto growing = [](long k) { return 1e-12 * std::pow(3.0, static_cast<double>(k) / 1000); };
  const auto fast = [](long) { return 1e-5; };
  CHECK(steps_until_told(steady) == 10250);
  CHECK(steps_until_told(up_and_down) <= 11000);
  CHECK(steps_until_told(up_and_down) > 0);
  // Steps whose errors are noise: each interval has a pace of its own, half to twice a mean at which the run would take
  // four times its limit.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> power(-1, 1);
  double length = 0;
  const auto noise = [&](long k) { return k % 250 == 0 ? length = 2e-7 * std::exp2(power(random)) : length; };
  CHECK(steps_until_told(noise) > 0);
  CHECK(steps_until_told(growing) == -1);
  CHECK(steps_until_told(fast) == -1);
}
