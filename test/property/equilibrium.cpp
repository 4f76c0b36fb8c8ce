// A run that starts at its static equilibrium: the parameters move the start, and every method's gradient
// must know. Differences of whole runs share no derivative with them. Tolerances as in gradients.cpp.
#include "costate/analysis/equilibrium.h"

#include <support/variants.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/integrator/simulate.h"
#include "costate/objective/output.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "gradient_compare.h"

using namespace costate;
using namespace costate::test;

namespace {

/// A crank pushed away from rest by an actuator; most of the gradient comes through the start.
const char* const text = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0
[point.C]
ground = true
x_m = 1.2
y_m = 0.4
[point.P]
x_m = 0.7
y_m = -0.7
[point.R]
x_m = 1.2
y_m = -1.2

[bar.crank]
from = "A"
to = "P"
mass_kg = 2
length_m = 1
[bar.rod]
from = "P"
to = "R"
mass_kg = 1
length_m = 0.8

[spring.S]
from = "C"
to = "P"
stiffness_N_per_m = 60
natural_length_m = 0.9
damping_N_s_per_m = 4
[spring.T]
from = "C"
to = "R"
stiffness_N_per_m = 40
natural_length_m = 1.1
damping_N_s_per_m = 3
[maxwell.M]
from = "A"
to = "R"
stiffness_N_per_m = 80
natural_length_m = 1
damping_N_s_per_m = 20

[force.push]
point = "R"
x_N = { kind = "sine", amplitude = 6, angular_frequency_rad_per_s = 5 }

[start]
equilibrium = true

[parameter.k]
number = "spring.S.stiffness_N_per_m"
[parameter.natural]
number = "spring.T.natural_length_m"
[parameter.mass]
number = "bar.crank.mass_kg"
[parameter.length]
number = "bar.rod.length_m"
[parameter.creep]
number = "maxwell.M.natural_length_m"
[parameter.damping]
number = "spring.S.damping_N_s_per_m"

[[cost.running]]
kind = "square"
output = "R.y"
[[cost.terminal]]
kind = "square"
output = "P.x"
target = 0.3

[run]
t_end_s = 1
rtol = 1e-9
parameters = ["k", "natural", "mass", "length", "creep", "damping"]
)";

}  // namespace

TEST_CASE("equilibrium: every method's gradient knows that the parameters move the start", "[equilibrium]") {
  const Scene scene = Scene::parse(text, "s.toml");
  Problem problem = make_problem(scene, {});
  const auto rho = problem.parameters.values();
  const double tolerance = 1e3 * problem.solver.rtol;
  std::vector<double> expected;
  double psi = 0;
  for (const Variant& v : variants()) {
    if (v.options.number("penalty_alpha") != 0 || integrator_methods(v.formulation).empty()) continue;
    Problem p = problem;
    p.formulation = v.formulation;
    if (expected.empty()) {
      p.formulation = "baumgarte";
      const GradientResult r = gradient(p, "differences", rho);
      expected = r.gradient;
      psi = r.psi;
      for (std::size_t j = 0; j < rho.size(); ++j)
        REQUIRE(r.gradient_error[j] * p.parameters.parameters[j].scale < tolerance * size_of(expected, p.parameters));
      p.formulation = v.formulation;
    }
    // A penalty's gap between the constraints and the motion shrinks with its default weight to about 1e-6.
    const bool penalty = v.formulation.rfind("penalty", 0) == 0;
    for (const auto& method : integrator_methods(v.formulation)) {
      CAPTURE(v.label, method);
      const GradientResult r = gradient(p, method, rho);
      CHECK(std::abs(r.psi - psi) <= (penalty ? 1e-5 : tolerance) * std::abs(psi));
      CHECK_BELOW(gradient_mismatch(r.gradient, expected, problem.parameters), penalty ? 1e-5 : 10 * tolerance);
    }
  }
}

// What a driver and a given position bear together was split between them by least norm, half the torque each, and the
// derivatives with it; the torque by hand is 2 kg 9.81 m/s^2 0.3 m cos(0.3).
TEST_CASE("equilibrium: a position that constraints fix already is not held a second time", "[equilibrium]") {
  const std::string crank = R"([gravity]
y_m_per_s2 = -9.81
[body.crank]
x_m = 0
y_m = 0
angle_rad = 0.3
mass_kg = 1
inertia_kg_m2 = 0.02
[point.O]
ground = true
x_m = 0
y_m = 0
[point.C]
on = "crank"
x_m = 0
y_m = 0
[revolute.o]
points = ["O", "C"]
[point.P]
on = "crank"
x_m = 0.3
y_m = 0
[point.H]
x_m = 0.28
y_m = -0.6
[mass.h]
point = "H"
mass_kg = 2
[spring.u]
from = "P"
to = "H"
stiffness_N_per_m = 100
natural_length_m = 0.3
damping_N_s_per_m = 1
[driver.d]
coordinate = "crank.angle"
law = 0.3
[run]
t_end_s = 0.1
parameters = ["a0"]
outputs = ["d.torque"]
[parameter.a0]
number = "driver.d.law"
[[cost.terminal]]
kind = "value"
output = "H.y"
[start]
equilibrium = true
)";
  for (const char* given : {"given = [\"crank.angle\"]\n", "given = [\"crank.x\"]\n"}) {
    const Problem p = make_problem(Scene::parse(crank + given, "s.toml"), {});
    CHECK_THROWS_WITH(gradient(p, "idas-adjoint", p.parameters.values()),
                      Catch::Contains("is held, and constraints, drivers or the other positions held fix it already"));
  }
  const Problem p = make_problem(Scene::parse(crank, "s.toml"), {});
  // H hangs below P = (0.3 cos, 0.3 sin): dH.y/da = 0.3 cos(0.3).
  CHECK(gradient(p, "idas-adjoint", p.parameters.values()).gradient[0] == Approx(0.3 * std::cos(0.3)).epsilon(1e-6));
  const Scene scene = Scene::parse(crank, "s.toml");
  Assembly assembly(scene.mechanism(), ParameterSelection());
  const Equilibrium e = find_equilibrium(assembly, 0, held_by_start(assembly), false);
  const auto torque = make_output(*scene.mechanism(), "d.torque");
  CHECK(std::abs(value_at_rest(*torque, assembly, 0, e)) == Approx(2 * 9.81 * 0.3 * std::cos(0.3)).epsilon(1e-9));
}
