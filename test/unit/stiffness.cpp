// Stiff motions on CVODES: Adams' method is left for BDF, with a word, or the run ends early with the cause.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/pace_watch.h"
#include "costate/integrator/segmented_run.h"
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

// Whoever notices it asks every 50 steps and believes four answers in a row.
TEST_CASE("stiffness: Adams' method is left within a few hundred steps") {
  for (const auto& [mass_kg, damping] : {std::pair{1.0, 1e12}, {1e-12, 1.0}})
    for (const char* formulation : {"baumgarte", "index1", "maggi"}) {
      CAPTURE(mass_kg, damping, formulation);
      Problem p = pendulum(mass_kg, damping);
      p.formulation = formulation;
      const std::unique_ptr<OdeSystem> system = p.make_ode();
      system->set_parameters(p.parameters.values().data());
      CvodeRun adams(*system, p.solver, p.monitor, StartDerivative::none);
      CHECK_THROWS_AS(adams.advance(p.solver.t_end), StiffError);
      adams.read_forward_counters();
      CHECK(adams.counters().steps < 500);
    }
}

// A mass that hangs at rest on a spring with a stiff damper: the motion takes two steps. Its adjoint swings sideways
// for 50 periods, beside a rate of c/m = 1e7 1/s that binds Adams' steps.
TEST_CASE("stiffness: an adjoint that is stiff where its motion is at rest is run by BDF") {
  Problem p = make_problem(Scene::parse(R"([gravity]
y_m_per_s2 = -10
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0
y_m = -1
[mass.bob]
point = "P"
mass_kg = 1
[spring.s]
from = "A"
to = "P"
stiffness_N_per_m = 100
natural_length_m = 0.9
damping_N_s_per_m = 1e7
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "value"
output = "P.x"
[[cost.terminal]]
kind = "value"
output = "P.y"
[parameter.m]
number = "mass.bob.mass_kg"
[run]
t_end_s = 100
parameters = ["m"]
)",
                                        "s.toml"));
  p.formulation = "baumgarte";
  take_notices();
  const GradientResult r = gradient(p, "cvodes-adjoint", p.parameters.values());
  CHECK(said_stiff());
  CHECK(r.counters.steps < 10);
  // Some 150 steps a period at rtol 1e-8 by order 5.
  CHECK(r.counters.backward_steps < 20'000);
  // P.y creeps by the rate k/c = 1e-5 1/s towards what another mass would hang at, -g/k lower a kilogram.
  CHECK(r.gradient[0] == Approx(-0.1 * -std::expm1(-1e-3)).epsilon(1e-6));
}

// At 0.3525 s bar and spring of the light mass are in line, and it begins to vibrate: 1e7 steps a second from there on.
TEST_CASE("stiffness: a vibration that would take millions of steps ends within some thousands") {
  for (const char* integrator : {"cvodes", "idas"}) {
    std::string said;
    try {
      run(pendulum(1e-12, 1), integrator);
    } catch (const SolverError& e) {
      said = e.what();
    }
    CAPTURE(said);
    const std::size_t at = said.find(" s after ");
    REQUIRE(at != std::string::npos);
    CHECK(std::stol(said.substr(at + 9)) < 9000);
    CHECK_THAT(said, Contains("very light masses"));
  }
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
  CHECK(steps_until_told(steady) == 2750);
  CHECK(steps_until_told(up_and_down) <= 4000);
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
