// What is not finite is named by element, law, line and time, at the start, at an equilibrium and in the middle of a
// run, whatever integrates.
#include "costate/analysis/not_finite.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Matchers::Contains;

namespace {

Problem problem_of(const Scene& scene, const std::string& formulation, const std::string& integrator) {
  Problem p = make_problem(scene);
  p.formulation = formulation;
  p.solver.integrator = integrator;
  p.solver.t_end = 1;
  p.solver.rtol = 1e-6;
  return p;
}

/// What a run of the scene dies of, at its place in the file.
std::string ends_with(const Scene& scene, const Problem& p) {
  try {
    simulate(p, p.parameters.values());
  } catch (const ModelError& e) {
    return scene.located(e).what();
  } catch (const RunNotFinite& e) {
    return scene.located(e.cause).what();
  } catch (const Error& e) {
    return e.what();
  }
  return "nothing";
}

const std::string kPendulum = R"([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0
[bar.arm]
from = "O"
to = "P"
mass_kg = 1
[spring.S]
from = "O"
to = "P"
stiffness_N_per_m = 100
natural_length_m = 1
[start]
given = ["P.y"]
[force.push]
point = "P"
y_N = {{ kind = "formula", formula = "{}" }}
)";

}  // namespace

TEST_CASE("not finite: a formula that leaves its domain during a run is named by every formulation and integrator") {
  // Beyond t = 0.4 s it is no number; up to there it is smooth enough for any step.
  const Scene scene = Scene::parse(fmt::format(fmt::runtime(kPendulum), "sqrt(0.4 - t)"), "s.toml");
  int runs = 0;
  for (const Formulation& f : formulations())
    for (const char* integrator : {"idas", "cvodes"}) {
      if (integrator == std::string("idas") ? !f.make_dae : !f.make_ode) continue;
      const std::string said = ends_with(scene, problem_of(scene, f.name, integrator));
      INFO(f.name << ", " << integrator << ": " << said);
      CHECK_THAT(said, Contains("s.toml:23:7: force.push: Its force is not a finite number at t = 0.4") &&
                           Contains("Its law is 'y_N'."));
      ++runs;
    }
  CHECK(runs > 10);
}

TEST_CASE("not finite: fixed steps name it as well") {
  // Nothing announces it, or steps that pass over it would be refused.
  const Scene scene = Scene::parse(fmt::format(fmt::runtime(kPendulum), "1 + 0*sqrt(0.4 - t)"), "s.toml");
  for (const double step : {0.0, 0.01}) {
    Problem p = problem_of(scene, "index3", "fixed");
    p.solver.step_s = step;
    const std::string said = ends_with(scene, p);
    INFO(said);
    CHECK_THAT(said, Contains("s.toml:23:7: force.push: Its force is not a finite number at t = 0.4") &&
                         Contains("Its law is 'y_N'."));
  }
}

TEST_CASE("not finite: a trial step beyond a domain that the motion does not leave is only too long") {
  // The last step of an integrator goes beyond the end of the run where nothing stops it: here to where the force is no
  // number.
  const Scene scene = Scene::parse(fmt::format(fmt::runtime(kPendulum), "1e-3*sqrt(1.0001 - t)"), "s.toml");
  for (const auto& [formulation, integrator] :
       {std::pair{"index1", "idas"}, {"baumgarte", "cvodes"}, {"maggi", "cvodes"}})
    CHECK(ends_with(scene, problem_of(scene, formulation, integrator)) == "nothing");
}

TEST_CASE("not finite: a road's law is named where the road stands, also at an equilibrium") {
  const std::string text = R"scene([gravity]
z_m_per_s2 = -9.81
[rigid_body.hub]
x_m = 0
y_m = 0
z_m = 0.33
mass_kg = 32
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1.4
inertia_zz_kg_m2 = 1
[point.rail]
ground = true
x_m = 0
y_m = 0
z_m = 0
[point.W]
on = "hub"
x_m = 0
y_m = 0
z_m = 0
[translational.guide]
points = ["rail", "W"]
axis_first = [0, 0, 1]
[tyre.T]
wheel = "W"
axis = [0, 1, 0]
road = "post"
model = "ride"
radius_m = 0.34
stiffness_N_per_m = 200000
damping_N_s_per_m = 100
[start]
equilibrium = true
[road.post]
kind = "post"
speed_m_per_s = 10
law = { kind = "formula", formula = "log(0 - 1)" }
)scene";
  const Scene scene = Scene::parse(text, "s.toml");
  const std::string said = ends_with(scene, problem_of(scene, "baumgarte", "idas"));
  INFO(said);
  CHECK_THAT(said, Contains("s.toml:37:7: tyre.T: Its force is not a finite number at t = 0 s.") &&
                       Contains("Its law is 'law' of [road.post]."));
}

TEST_CASE("not finite: a cost outside its domain is named with its time, whatever method runs into it") {
  // P falls from the height of O along the circle: its x is 0.4 m once, in the middle of the run.
  const std::string text = R"scene([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.6
y_m = -0.8
[bar.rod]
from = "O"
to = "P"
mass_kg = 2
[start]
given = ["P.x"]
[output.f]
formula = "sqrt(P.x - 0.4)"
unit = "m"
[[cost.running]]
kind = "value"
output = "f"
[parameter.m]
number = "bar.rod.mass_kg"
)scene";
  const Scene scene = Scene::parse(text, "s.toml");
  const auto names_it = Contains("the running cost of 'f' is nan at t = 0.236 s first");
  CHECK_THAT(ends_with(scene, problem_of(scene, "baumgarte", "idas")), names_it);
  for (const SensitivityMethod& method : sensitivity_methods()) {
    INFO(method.name);
    const Problem p = problem_of(scene, "baumgarte", "");
    CHECK_THROWS_WITH(gradient(p, method.name, p.parameters.values()), names_it);
  }
  // The same motion with the cost in its domain, which fails for its own reason, is told as before.
  Problem short_of_steps = problem_of(Scene::parse(text, "s.toml"), "baumgarte", "cvodes");
  short_of_steps.solver.t_end = 0.2;
  short_of_steps.solver.max_steps = 5;
  CHECK_THAT(ends_with(scene, short_of_steps), Contains("5 steps") && !Contains("cost"));
}

TEST_CASE("not finite: a cost whose derivative alone is no number ends every method's run by its name") {
  // exp overflows away from x = 5 m: the bell is 0 there, its derivative 0 inf. The hand-derived adjoint took such a
  // step's error as none, and did not end.
  const Scene scene = Scene::parse(R"scene([point.P]
x_m = 0
y_m = 0
vx_m_per_s = 1
[mass.m]
point = "P"
mass_kg = 1
[output.bell]
formula = "1/(exp((P.x - 5)/w) + exp((5 - P.x)/w))^2"
unit = "1"
w = 1e-5
[[cost.running]]
kind = "value"
output = "bell"
[run]
t_end_s = 10
parameters = ["point.P.vx_m_per_s"]
)scene",
                                   "s.toml");
  for (const SensitivityMethod& method : sensitivity_methods()) {
    if (std::string(method.name) == "differences") continue;  // psi is a number
    INFO(method.name);
    Problem p = problem_of(scene, "baumgarte", "");
    p.solver.t_end = 10;
    CHECK_THROWS_WITH(gradient(p, method.name, p.parameters.values()),
                      Contains("the derivative of the running cost of 'bell' is not finite at t = 0 s first"));
  }
}
