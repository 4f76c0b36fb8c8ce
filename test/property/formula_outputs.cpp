// Outputs that a scene defines by formulas: values and derivatives against path duals of the same formula written out,
// gradients of costs on them by every formulation and method, runs that end by them, Hessians; and what is refused.
// (Gradients and second derivatives at random states are those of the kind's example: example_scenes.cpp,
// second_terms.cpp.)
#include <fmt/format.h>
#include <support/variants.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/integrator/integrators.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "gradient_compare.h"

using namespace costate;
using namespace costate::test;

namespace {

/// A rod with a spring and a damper to the wall.
std::string rod(const std::string& rest) {
  return R"(
[gravity]
y_m_per_s2 = -9.81

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

[parameter.k]
number = "spring.strut.stiffness_N_per_m"

[run]
t_end_s = 1.5
parameters = ["c", "k"]
)" + rest;
}

Scene parse(const std::string& rest) { return Scene::parse(rod(rest), "rod.toml"); }

const std::string kFormulas = R"scene(
[output.power]
formula = "strut.force*strut.rate*(1 + b*sin(3*t))"
unit = "W"
b = 0.4

[output.mix]
formula = "power + m*P.x_ddot*tension/(1 + P.y^2) + energy.kinetic*exp(-t)"
unit = "W"
tension = "lambda.bar.rod.length"
m = 0.05

[output.smooth]
formula = "power + m*exp(-t)*energy.kinetic*P.x_dot"
unit = "W"
m = 0.05

[parameter.b]
number = "output.power.b"

[parameter.m]
numbers = ["output.mix.m", "output.smooth.m"]
)scene";

/// Every method that the formulation has, but differences.
std::vector<std::string> methods_of(const std::string& formulation) {
  std::vector<std::string> r;
  for (const auto& m : sensitivity_methods())
    if (!m.perturbs && refusal(m, find_formulation(formulation)).empty()) r.push_back(m.name);
  return r;
}

}  // namespace

// Integrators and hand-derived equations keep errors of some hundreds of rtol = 1e-9 (gradients.cpp); the penalties
// differ by O(1/alpha), with the default weight below that. Fixed steps have errors of h^2 of their own and are
// compared with differences of themselves.
TEST_CASE("formula outputs: gradients by every formulation and method", "[outputs]") {
  const auto cost = [](const std::string& output) {
    return kFormulas + fmt::format(R"(
[[cost.running]]
kind = "square"
output = "{0}"
target = 0.3

[[cost.running]]
kind = "value"
output = "power"
weight = 2

[[cost.terminal]]
kind = "square"
output = "{0}"
)",
                                   output);
  };
  // Of accelerations and multipliers, and without.
  for (const char* output : {"mix", "smooth"}) {
    const Scene scene = parse(cost(output));
    Problem problem = make_problem(scene, {"c", "k", "b", "m"});
    problem.solver.rtol = 1e-9;
    const std::vector<double> rho = problem.parameters.values();
    Problem oracle = problem;
    oracle.solver.integrator = "cvodes";
    const GradientResult expected = gradient(oracle, "differences", rho);
    int count = 0, refused = 0;
    for (const auto& f : formulations())
      for (const auto& method : methods_of(f.name)) {
        INFO(output << ", " << f.name << ", " << method);
        Problem p = problem;
        p.formulation = f.name;
        // Explicit schemes with step control keep a tolerance as integrators do.
        const bool fixed = find_sensitivity_method(method).needs == SensitivityMethod::Needs::discrete &&
                           find_integrator(discrete_integrator_of(p)).form == Integrator::Form::steps;
        GradientResult own = expected;
        if (fixed) {
          p.solver.integrator = "fixed";
          p.solver.step_s = 2e-3;
          own = gradient(p, "differences", rho);
        }
        GradientResult found;
        try {
          found = gradient(p, method, rho);
        } catch (const CapabilityError& e) {
          // Not every formulation has the discrete adjoint's products; second-order adjoints have no rates of
          // accelerations.
          if (find_sensitivity_method(method).needs == SensitivityMethod::Needs::discrete) continue;
          CHECK(std::string(output) == "mix");
          CHECK_THAT(e.what(), Catch::Contains("running cost depends on accelerations"));
          ++refused;
          continue;
        }
        ++count;
        // Of a penalty: O(1/alpha) in multipliers; of differences of fixed steps: what they say themselves.
        const double tolerance = fixed || !f.exact_constraints() ? 1e-5 : 1e-6;
        CHECK(std::abs(found.psi - own.psi) <= tolerance * std::abs(own.psi));
        CHECK_BELOW(gradient_mismatch(found.gradient, own.gradient, p.parameters), tolerance);
      }
    CHECK(count >= 30);
    CHECK(refused == (std::string(output) == "mix" ? 2 : 0));
  }
}

// The same cost written twice: what only the formula stands between is rounding, and where that moves the steps, the
// tolerance. CVODES's steps are those of a cost that may be narrow somewhere (a formula), and of one that is not: its
// tolerance is so tight that errors of several hundred rtol stay below what is asked.
TEST_CASE("formula outputs: P.x^2 by a formula is the square of P.x", "[outputs]") {
  const Scene plain = parse("[[cost.running]]\nkind = \"square\"\noutput = \"P.x\"\n");
  const Scene formula = parse(
      "[output.square]\nformula = \"P.x^2\"\nunit = \"m^2\"\n[[cost.running]]\nkind = \"value\"\noutput = "
      "\"square\"\n");
  Problem a = make_problem(plain), b = make_problem(formula);
  const auto rho = a.parameters.values();
  const double rtol = a.solver.rtol;
  for (const char* method : {"idas-adjoint", "idas-forward", "cvodes-adjoint", "hand-adjoint"}) {
    INFO(method);
    a.solver.rtol = b.solver.rtol = std::string(method) == "cvodes-adjoint" ? 1e-12 : rtol;
    const GradientResult x = gradient(a, method, rho), y = gradient(b, method, rho);
    CHECK(std::abs(x.psi - y.psi) <= 1e-9 * std::abs(x.psi));
    CHECK_BELOW(gradient_mismatch(y.gradient, x.gradient, a.parameters), 1e-9);
  }
  a.solver.rtol = b.solver.rtol = rtol;
  const Hessian h = hessian(a, rho), i = hessian(b, rho);
  CHECK((h.matrix - i.matrix).norm() <= 1e-7 * h.matrix.norm());
}

TEST_CASE("formula outputs: a run ends where one crosses a level, and its time has a gradient", "[outputs]") {
  Scene scene = parse(R"(
[output.reach]
formula = "P.x + 0.1*P.x_dot - s*t"
unit = "m"
s = 0.2

[parameter.s]
number = "output.reach.s"

[[cost.terminal]]
kind = "value"
output = "time"
)");
  scene = scene.with_override("run.ends_when", "{ output = \"reach\", below = 0.1 }");
  const Problem p = make_problem(scene, {"k", "s"});
  const auto rho = p.parameters.values();
  const GradientResult expected = gradient(p, "differences", rho);
  for (const char* method : {"idas-adjoint", "cvodes-forward", "hand-adjoint"}) {
    INFO(method);
    const GradientResult found = gradient(p, method, rho);
    REQUIRE(found.end);
    // The run that goes to the end time comes as near to the level as its tolerance.
    CHECK(std::abs(found.psi - found.end->t) <= 1e3 * p.solver.rtol);
    CHECK_BELOW(gradient_mismatch(found.gradient, expected.gradient, p.parameters), 1e-5);
  }
}

TEST_CASE("formula outputs: mistakes have their place", "[outputs]") {
  using Catch::Contains;
  const auto at = [](const std::string& formula, const std::string& more = "") {
    return [=] { parse("[output.f]\nunit = \"1\"\nformula = \"" + formula + "\"\n" + more); };
  };
  CHECK_THROWS_WITH(at("P.z + 1")(), Contains("rod.toml:45") && Contains("no output 'P.z'"));
  CHECK_THROWS_WITH(at("sinus(P.x)")(), Contains("no function 'sinus'") && Contains("'sin'"));
  CHECK_THROWS_WITH(at("P.x +")(), Contains("rod.toml:45") && Contains("it ends where"));
  CHECK_THROWS_WITH(at("a*P.x", "a = 2\nb = 3\n")(), Contains("rod.toml:47") && Contains("'b' is in no formula"));
  CHECK_THROWS_WITH(at("a*P.x", "a = \"P.q\"\n")(), Contains("no output 'P.q'"));
  CHECK_THROWS_WITH(at("g", "[output.g]\nunit = \"1\"\nformula = \"2*f\"\n")(), Contains("defined by itself: f, g, f"));
  CHECK_THROWS_WITH(parse("[output.time]\nunit = \"s\"\nformula = \"2*t\"\n"), Contains("is an output of every scene"));
  CHECK_THROWS_WITH(parse("[output.f]\nformula = \"2*t\"\n"), Contains("unit"));
  // The energy has no derivative: a file can hold the formula, a cost not.
  const Scene scene = parse(
      "[output.f]\nunit = \"J\"\nformula = \"2*energy.total\"\n[[cost.running]]\nkind = \"value\"\noutput = \"f\"\n");
  const Problem p = make_problem(scene);
  CHECK_THROWS_WITH(gradient(p, "idas-adjoint", p.parameters.values()), Contains("energy.total"));
}

// A yaw is known up to full turns: its sine goes on, it itself jumps.
TEST_CASE("formula outputs: a folded angle within is seen", "[outputs]") {
  const auto psi = [](const std::string& formula) {
    const Scene scene = Scene::parse(R"(
[rigid_body.b]
x_m = 0
y_m = 0
z_m = 0
omega_z_rad_per_s = 4
mass_kg = 1
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1
inertia_zz_kg_m2 = 1

[output.f]
unit = "1"
formula = ")" + formula + R"("

[start]
given = ["b"]

[[cost.running]]
kind = "value"
output = "f"

[run]
t_end_s = 1
)",
                                     "turn.toml");
    return simulate(make_problem(scene), {}).psi;
  };
  // The integral of sin(4 t) over a second.
  CHECK(std::abs(psi("sin(b.yaw)") - (1 - std::cos(4.0)) / 4) < 1e-6);
  CHECK_THROWS_WITH(psi("2*b.yaw"), Catch::Contains("'b.yaw' in the running cost passes half a turn"));
}
