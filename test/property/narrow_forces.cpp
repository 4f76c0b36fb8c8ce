// Forces that act over a short part of the way, a detent that a wheel passes, a wall, a gust, and costs that look at
// one. Where next to nothing else moves, steps are as long as one likes, and one of them would pass over all of it.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"
#include "costate/integrator/integrators.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;
using Catch::Detail::Approx;

namespace {

// A wheel that turns by 4 rad/s, and what acts on it; psi is its angle after 6 s.
std::string wheel(const std::string& what) {
  return R"([body.w]
x_m = 0
y_m = 0
angular_velocity_rad_per_s = 4
mass_kg = 1
inertia_kg_m2 = 0.1
[driver.x]
coordinate = "w.x"
law = 0
[driver.y]
coordinate = "w.y"
law = 0
[start]
given = ["w.angle"]
[run]
t_end_s = 6
[[cost.terminal]]
kind = "value"
output = "w.angle"
[parameter.speed]
number = "body.w.angular_velocity_rad_per_s"
)" + what;
}

// A mass that falls from 3 m; psi is its height at the end.
std::string falling(const std::string& what) {
  return R"([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0
y_m = 3
[mass.m]
point = "P"
mass_kg = 20
[driver.x]
coordinate = "P.x"
law = 0
[start]
given = ["P.y"]
[run]
t_end_s = 1
[[cost.terminal]]
kind = "value"
output = "P.y"
[parameter.z0]
number = "point.P.y_m"
)" + what;
}

struct Case {
  const char* name;
  std::string scene;
  double psi;
};

// By scipy's solve_ivp, Radau and DOP853 at rtol 1e-12 and steps of 1 ms at most.
std::vector<Case> cases() {
  return {
      {"a detent by a formula",
       wheel("[couple.c]\nangle = \"w\"\nformula = \"A*exp(-((w.angle-a)/s)^2)\"\nA = 2\na = 12\ns = 0.1\n"),
       26.41776726},
      {"a spring whose law is a wall",
       falling("[spring.s]\nfrom = \"O\"\nto = \"P\"\nnatural_length_m = 0.5\nspring_law = { kind = \"formula\", "
               "formula = \"-k*exp(-(x+0.2)/0.01)\", k = 200 }\n"),
       1.7592163421},
      {"a wall by a formula",
       falling("[force.s]\npoint = \"P\"\nformula_y_N = \"80000/(1+exp((P.y-0.3)/0.01))*(0.35-P.y)\"\n"), 1.66613712}};
}

Problem problem_of(const std::string& scene) { return make_problem(Scene::parse(scene, "narrow.toml"), {}); }

}  // namespace

TEST_CASE("narrow forces: every integrator meets them", "[narrow]") {
  for (const Case& c : cases())
    for (const char* integrator : {"idas", "cvodes", "dopri5", "dop853", "radau3", "radau5", "radau9"})
      for (const double rtol : {1e-6, 1e-9}) {
        CAPTURE(c.name, integrator, rtol);
        Problem p = problem_of(c.scene);
        p.formulation = "baumgarte";
        p.solver.integrator = integrator;
        p.solver.rtol = rtol;
        take_notices();
        const double psi = simulate(p, p.parameters.values()).psi;
        // What a collision makes of a step's error: some hundreds of times rtol.
        CHECK(psi == Approx(c.psi).epsilon(1e3 * rtol).margin(1e-8));
      }
}

TEST_CASE("narrow forces: adjoints meet them on their way back", "[narrow]") {
  // Against forward sensitivities at a tight tolerance.
  for (const Case& c : cases()) {
    Problem p = problem_of(c.scene);
    p.parameters = p.mechanism->select({c.scene.find("[body.w]") == 0 ? "speed" : "z0"});
    const auto rho = p.parameters.values();
    p.formulation = "baumgarte";
    p.solver.rtol = 1e-11;
    const double expected = gradient(p, "cvodes-forward", rho).gradient[0];
    p.solver.rtol = 1e-8;
    for (const char* method : {"idas-adjoint", "cvodes-adjoint", "hand-adjoint", "idas-forward"}) {
      CAPTURE(c.name, method);
      take_notices();
      const GradientResult r = gradient(p, method, rho);
      CHECK(r.gradient[0] == Approx(expected).epsilon(1e-4));
    }
  }
}

TEST_CASE("narrow forces: fixed steps that pass over one say so", "[narrow]") {
  Problem p = problem_of(cases()[0].scene);
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  p.solver.step_s = 6.0 / 17;  // past it on both sides
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Catch::Contains("couple.c acts from"));
}

namespace {
// A mass that passes a gate at `a` at 10 m/s; psi looks at it there.
std::string gate(const std::string& cost) {
  return R"scene([point.P]
x_m = 0
y_m = 0
vx_m_per_s = 10
[mass.m]
point = "P"
mass_kg = 1
[output.g]
formula = "F*exp(-((P.x-a)/w)^2)"
unit = "1"
F = 20
a = 30
w = 0.5
[output.twice]
formula = "2*g"
unit = "1"
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 5
[parameter.F]
number = "output.g.F"
[parameter.speed]
number = "point.P.vx_m_per_s"
[[cost.running]]
)scene" + cost;
}
}  // namespace

TEST_CASE("narrow costs: psi and gradient of a gate that is passed", "[narrow]") {
  // The integral of F e^(-((v t - a)/w)^2) over all times is F w sqrt(pi)/v, that of its square F^2 w sqrt(pi/2)/v.
  const double of_value = 20 * 0.5 * std::sqrt(M_PI) / 10, of_square = 400 * 0.5 * std::sqrt(M_PI / 2) / 10;
  const struct {
    const char* cost;
    double psi, power;
  } costs[] = {{"kind = \"value\"\noutput = \"g\"\n", of_value, 1},
               {"kind = \"value\"\noutput = \"twice\"\n", 2 * of_value, 1},
               {"kind = \"square\"\noutput = \"g\"\n", of_square, 2}};
  for (const auto& c : costs) {
    Problem p = problem_of(gate(c.cost));
    p.parameters = p.mechanism->select({"F", "speed"});
    const auto rho = p.parameters.values();
    int runs = 0;
    for (const Formulation& f : formulations())
      for (const SensitivityMethod& m : sensitivity_methods()) {
        if (m.perturbs || !refusal(m, f).empty()) continue;
        p.formulation = f.name;
        std::vector<std::string> on = integrators_of(m, f);
        if (on.empty()) on = {""};  // a method of its own
        for (const std::string& integrator : on) {
          if (has_fixed_steps(integrator)) continue;
          CAPTURE(c.cost, f.name, m.name, integrator);
          p.solver.integrator = integrator;
          take_notices();
          const GradientResult r = gradient(p, m.name, rho);
          // A hundred rtol, and a thousand of a gradient.
          CHECK(r.psi == Approx(c.psi).epsilon(1e-6));
          CHECK(r.gradient[0] == Approx(c.power * c.psi / 20).epsilon(1e-5));
          // Going in and coming out cancel in an adjoint to a part of 70 to 100 of what either is.
          CHECK(r.gradient[1] == Approx(-c.psi / 10).epsilon(1e-4));
          ++runs;
        }
        p.solver.integrator.clear();
      }
    CHECK(runs > 40);
  }
  Problem p = problem_of(gate(costs[0].cost));
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  p.solver.step_s = 5.0 / 17;
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Catch::Contains("output.g acts from"));
}

TEST_CASE("narrow forces: a formula that is smooth costs no steps", "[narrow]") {
  // The same spring by its keys and by a formula.
  const auto steps = [](const std::string& spring) {
    Problem p = problem_of(falling(spring));
    p.formulation = "baumgarte";
    p.solver.integrator = "dop853";
    return simulate(p, p.parameters.values()).counters.steps;
  };
  const std::string ends = "[spring.s]\nfrom = \"O\"\nto = \"P\"\nnatural_length_m = 0.5\n";
  CHECK(steps(ends + "spring_law = { kind = \"formula\", formula = \"k*x\", k = 100 }\n") ==
        steps(ends + "stiffness_N_per_m = 100\n"));
}

// Where such a law leaves zero it looks the same at every scale, down to rounding: looks have to end.
TEST_CASE("narrow forces: laws that are level between breaks take no more steps than they have to") {
  for (const char* name :
       {"level_between_stops", "level_between_steps", "level_in_cost", "level_in_force", "level_in_smooth_cost"}) {
    double right = NAN;
    for (const auto& [formulation, integrator] : {std::pair{"maggi", "dop853"},
                                                  {"baumgarte", "idas"},
                                                  {"baumgarte", "cvodes"},
                                                  {"index1", "idas"},
                                                  {"index2", "radau5"},
                                                  {"penalty", "idas"}}) {
      INFO(name << " by " << formulation << " on " << integrator);
      Problem p = problem_of_case(name);
      p.formulation = formulation;
      p.solver.integrator = integrator;
      double x = 0;
      const Simulation r = simulate(p, {}, {p.solver.t_end}, [&](const MechanismState& s, System& system) {
        x = s.q[system.assembly().n() == 3 ? 2 : 0];  // a body's angle, a point's x
      });
      if (std::isnan(right)) right = x;
      // A push away from the middle makes 6e4 of rtol 1e-8 there (by dop853 at 1e-12: -0.608143684).
      CHECK(x == Approx(right).margin(std::string(name) == "level_in_force" ? 2e-3 : 1e-5));
      CHECK(r.counters.steps < 6000);
    }
  }
  take_notices();
}
