// Costs at samples of measured data: psi against the same motion's outputs, gradients by the methods that take samples
// against differences of runs, and that the others refuse.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/output.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "gradient_compare.h"

using namespace costate;
using namespace costate::test;

namespace {

const std::string kScene = R"(
[gravity]
y_m_per_s2 = -9.81

[data.run]
columns = ["t [ms]", "x [mm]", "a [m/s^2]", "s [mm]"]
rows = [[0, 600, 9, 5], [100, 590, 1.5, 5], [250, 560, -0.5, 8], [250.5, 555, 0, 8], [700, 300, -2, 5], [1000, 100, 1, 5]]

[point.A]
ground = true
x_m = 0
y_m = 0

[point.wall]
ground = true
x_m = 1
y_m = -1

[point.P]
x_m = 0.6
y_m = -0.8

[bar.rod]
from = "A"
to = "P"
mass_kg = 2
length_m = 1

[spring.strut]
from = "P"
to = "wall"
stiffness_N_per_m = 20
natural_length_m = 1
damping_N_s_per_m = 1

[start]
given = ["P.x"]

[parameter.c]
number = "spring.strut.damping_N_s_per_m"

[parameter.x0]
number = "point.P.x_m"

[parameter.w]
number = "cost.samples[0].weight"

[[cost.samples]]
data = "run"
column = "x"
sigma_column = "s"
output = "P.x"
weight = 1e-3

[run]
t_end_s = 1
parameters = ["c", "x0", "w"]
)";

const std::string kAccelerations = R"(
[[cost.samples]]
data = "run"
column = "a"
sigma = 0.5
output = "P.x_ddot"
from_s = 0.05
to_s = 0.8

[[cost.running]]
kind = "square"
output = "P.y"

[[cost.terminal]]
kind = "value"
output = "P.x_dot"
)";

}  // namespace

TEST_CASE("samples: psi is the sum over the samples", "[samples]") {
  const Scene scene = Scene::parse(kScene, "samples.toml");
  const Problem p = make_problem(scene);
  const auto x = make_output(*p.mechanism, "P.x");
  const double times[] = {0, 0.1, 0.25, 0.2505, 0.7, 1}, measured[] = {0.6, 0.59, 0.56, 0.555, 0.3, 0.1},
               sigma[] = {5e-3, 5e-3, 8e-3, 8e-3, 5e-3, 5e-3};
  for (const char* integrator : {"idas", "cvodes"}) {
    Problem on = p;
    on.solver.integrator = integrator;
    Problem plain = on;
    plain.objective = {};
    double sum = 0;
    std::size_t k = 0;
    simulate(plain, plain.parameters.values(), {std::begin(times), std::end(times)},
             [&](const MechanismState& s, System& system) {
               sum += 1e-3 * std::pow((x->value(s, system.assembly()) - measured[k]) / sigma[k], 2);
               ++k;
             });
    REQUIRE(k == 6);
    // The same run: samples are read off its steps.
    CHECK(std::abs(simulate(on, on.parameters.values()).psi - sum) <= 1e-10 * sum);
  }
}

// As in gradients.cpp: integrators leave some hundreds of rtol = 1e-9.
TEST_CASE("samples: gradients against differences", "[samples]") {
  for (const std::string& more : {std::string(), kAccelerations}) {
    const Scene scene = Scene::parse(kScene + more, "samples.toml");
    Problem problem = make_problem(scene);
    problem.solver.rtol = 1e-9;
    const auto rho = problem.parameters.values();
    const GradientResult expected = gradient(problem, "differences", rho);
    for (const auto& f : formulations())
      for (const auto& m : sensitivity_methods()) {
        if (m.perturbs || !refusal(m, f).empty()) continue;
        INFO(f.name << ", " << m.name << (more.empty() ? "" : ", accelerations"));
        Problem p = problem;
        p.formulation = f.name;
        if (m.needs != SensitivityMethod::Needs::dae && m.needs != SensitivityMethod::Needs::ode) {
          CHECK_THROWS_AS(gradient(p, m.name, rho), CapabilityError);
          continue;
        }
        const GradientResult found = gradient(p, m.name, rho);
        const double tolerance = f.exact_constraints() ? 2e-6 : 1e-5;
        CHECK(std::abs(found.psi - expected.psi) <= tolerance * std::abs(expected.psi));
        CHECK_BELOW(gradient_mismatch(found.gradient, expected.gradient, p.parameters), tolerance);
      }
  }
}

// Few stored steps: the way back repeats segments, and stops in them.
TEST_CASE("samples: an adjoint with many checkpoints", "[samples]") {
  Problem p = make_problem(Scene::parse(kScene + kAccelerations, "samples.toml"));
  const auto rho = p.parameters.values();
  for (const char* method : {"idas-adjoint", "cvodes-adjoint"}) {
    INFO(method);
    const GradientResult whole = gradient(p, method, rho);
    Problem few = p;
    few.solver.checkpoint_steps = 12;
    const GradientResult parts = gradient(few, method, rho);
    CHECK(parts.counters.checkpoints > 2);
    CHECK_BELOW(gradient_mismatch(parts.gradient, whole.gradient, p.parameters), 1e-5);
  }
}

TEST_CASE("samples: what does not take them says so", "[samples]") {
  using Catch::Contains;
  const Scene scene = Scene::parse(kScene, "samples.toml");
  Problem p = make_problem(scene);
  const auto rho = p.parameters.values();
  CHECK_THROWS_WITH(hessian(p, rho), Contains("cost.samples[0]"));
  CHECK_THROWS_WITH(gradient(p, "hand-adjoint", rho), Contains("cost.samples[0]"));
  Problem fixed = p;
  fixed.formulation = "index3";
  fixed.solver.integrator = "fixed";
  CHECK_THROWS_WITH(simulate(fixed, rho), Contains("cost.samples[0]"));
  p.solver.t_end = 0.9;
  CHECK_THROWS_WITH(simulate(p, rho), Contains("has a sample at t = 1 s"));
  const Problem ends = make_problem(scene.with_override("run.ends_when", "{ output = \"P.x\", below = 0.3 }"));
  CHECK_THROWS_WITH(simulate(ends, rho), Contains("ends_when"));
  CHECK_THROWS_WITH(
      scene.with_override("cost.samples", "[{ data = \"ran\", column = \"x\", output = \"P.x\", sigma = 1 }]"),
      Contains("no table of data 'ran'"));
  CHECK_THROWS_WITH(
      scene.with_override("cost.samples", "[{ data = \"run\", column = \"y\", output = \"P.x\", sigma = 1 }]"),
      Contains("no column 'y'"));
}
