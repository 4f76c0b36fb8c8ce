// Parameters that cannot move alone, and were moved: an orientation under a spin that is written, one of redundant
// links. And formulas at a power's zero, starts beside points without mass, which were refused for other reasons.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "costate/analysis/equilibrium.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;
using Catch::Matchers::Contains;

TEST_CASE("held parameters: an orientation cannot vary where the start gives what its spin makes of it") {
  // The rates e' stood for the spin at the written orientation: d(psi)/d(e1) was 0.6653 by every method, differences of
  // the scene read again say 0.4946.
  CHECK_THROWS_WITH(problem_of_case("spin_and_orientation", {"run.parameters=[\"e1\"]"}),
                    Contains("cannot vary") && Contains("given_velocities"));
  const std::string velocities = "start.given_velocities=[\"b.omega_x\",\"b.omega_y\",\"b.omega_z\"]";
  Problem p = problem_of_case("spin_and_orientation", {"run.parameters=[\"e1\"]", velocities, "run.rtol=1e-10"});
  p.formulation = "baumgarte";
  const double h = 1e-3;
  const auto psi = [&](double e1) {
    Problem q = problem_of_case("spin_and_orientation", {"run.parameters=[\"e1\"]", velocities, "run.rtol=1e-11",
                                                         fmt::format("rigid_body.b.e1={:.17g}", e1)});
    q.formulation = "baumgarte";
    return simulate(q, q.parameters.values()).psi;
  };
  // Scenes read again, also beyond a thousandth of the norm; O(h^4) by Richardson.
  const double first = (psi(0.2 + h) - psi(0.2 - h)) / (2 * h),
               second = (psi(0.2 + 2 * h) - psi(0.2 - 2 * h)) / (4 * h);
  CHECK(gradient(p, "idas-adjoint", p.parameters.values()).gradient[0] ==
        Approx((4 * first - second) / 3).epsilon(1e-5));
  CHECK_NOTHROW(psi(0.25));
  take_notices();
}

TEST_CASE("held parameters: one of redundant links has no derivative of its own, all together have") {
  for (const auto& [formulation, method] : {std::pair{"augmented-lagrangian", "cvodes-adjoint"},
                                            {"maggi", "hand-adjoint"},
                                            {"penalty", "idas-forward"},
                                            {"maggi", "discrete-adjoint"}}) {
    Problem p = problem_of_case("three_links", {"run.parameters=[\"Lx\"]"});
    p.formulation = formulation;
    p.solver.integrator.clear();
    CAPTURE(formulation, method);
    CHECK_THROWS_WITH(gradient(p, method, p.parameters.values()),
                      Contains("'Lx' cannot vary alone") && Contains("distance.d"));
    take_notices();
  }
  Problem all = problem_of_case(
      "three_links",
      {"parameter.all={numbers=[\"distance.d0.length_m\",\"distance.d1.length_m\",\"distance.d2.length_m\"]}",
       "run.parameters=[\"all\"]"});
  all.formulation = "maggi";
  all.solver.integrator.clear();
  // 1.70046573 by scipy.
  CHECK(gradient(all, "cvodes-adjoint", all.parameters.values()).gradient[0] == Approx(1.70046573).epsilon(1e-6));
  take_notices();
}

TEST_CASE("held parameters: powers have a slope at zero where it is zero") {
  const auto problem = [](const std::string& what, const std::string& more) {
    Problem p = make_problem(Scene::parse("[point.P]\nx_m = 0\ny_m = 0\n[mass.m]\npoint = \"P\"\nmass_kg = 2\n" + what +
                                              "c = 3\n" + more +
                                              "[[cost.terminal]]\nkind = \"square\"\noutput = \"P.x\"\n[run]\n"
                                              "t_end_s = 1\nrtol = 1e-10\nparameters = [\"force.f.c\"]\n",
                                          "s.toml"));
    return p;
  };
  const std::string given = "[start]\ngiven = [\"P.x\", \"P.y\"]\n";
  for (const char* formula : {"5 - c*P.x^1.5", "5 - c*max(P.x, 0)^1.5", "5 - c*max(0, P.x)^1.5"})
    for (const char* formulation : {"index1", "baumgarte"}) {
      CAPTURE(formula, formulation);
      Problem p = problem(fmt::format("[force.f]\npoint = \"P\"\nformula_x_N = \"{}\"\n", formula), given);
      p.formulation = formulation;
      const GradientResult r = gradient(p, "idas-adjoint", p.parameters.values());
      // By scipy.
      CHECK(r.psi == Approx(1.32190020417).epsilon(1e-8));
      CHECK(r.gradient[0] == Approx(-0.0734723).epsilon(1e-5));
      take_notices();
    }
  // A root has none, and the message says so.
  Problem p = problem("[force.f]\npoint = \"P\"\nformula_x_N = \"5 - c*P.x^0.5\"\n", given);
  p.formulation = "index1";
  CHECK_THROWS_WITH(gradient(p, "idas-adjoint", p.parameters.values()), Contains("not finite"));
  take_notices();
}

TEST_CASE("held parameters: points without mass between springs hold an equilibrium") {
  const Scene scene = Scene::parse(R"([point.A]
ground = true
x_m = 0
y_m = 0
[point.Q]
x_m = 1.1
y_m = 0
[point.P]
x_m = 2
y_m = 0
[mass.m]
point = "P"
mass_kg = 2
[gravity]
x_m_per_s2 = 1
[driver.y]
coordinate = "P.y"
law = 0
[driver.yq]
coordinate = "Q.y"
law = 0
[spring.s]
from = "A"
to = "Q"
stiffness_N_per_m = 50
natural_length_m = 1
[spring.s2]
from = "Q"
to = "P"
stiffness_N_per_m = 70
natural_length_m = 1
[start]
equilibrium = true
)",
                                   "s.toml");
  Assembly assembly(scene.mechanism(), ParameterSelection());
  const Equilibrium e = find_equilibrium(assembly, 0, held_by_start(assembly), false);
  // In series: both bear 2 N.
  CHECK(e.q[scene.mechanism()->coordinate("Q.x")] == Approx(1 + 2.0 / 50).epsilon(1e-9));
  CHECK(e.q[scene.mechanism()->coordinate("P.x")] == Approx(2 + 2.0 / 50 + 2.0 / 70).epsilon(1e-9));
}

TEST_CASE("held parameters: redundant rows that a parameter does not move just at the start") {
  // A ratio moves no gear's row at the angle zero, a crank's pivot none across the crank, a law none before it begins:
  // numbers came out (1.6, 0.447, 0.833, 0.212, the same by several formulations) of motions that do not exist.
  for (const auto& [name, parameter] : {std::pair{"gear_loop", "gear.g1.ratio"},
                                        {"three_cranks", "point.Q.y_m"},
                                        {"gear_and_two_drivers", "driver.b.law.coefficients[2]"},
                                        {"two_screws", "screw.s1.lead_m_per_turn"}})
    for (const auto& [formulation, method] : {std::pair{"maggi", "cvodes-forward"},
                                              {"augmented-lagrangian", "cvodes-adjoint"},
                                              {"penalty", "idas-adjoint"},
                                              {"maggi", "hand-adjoint"}}) {
      Problem p = problem_of_case(name, {});
      p.formulation = formulation;
      p.solver.integrator.clear();
      CAPTURE(name, formulation, method);
      for (int again = 0; again < 2; ++again)
        CHECK_THROWS_WITH(gradient(p, method, p.parameters.values()),
                          Contains(std::string("'") + parameter + "' cannot vary alone"));
      take_notices();
    }
  // What moves together may: psi = z = l/(2 pi) angle, the lead of both screws.
  Problem both = problem_of_case(
      "two_screws",
      {"parameter.l={numbers=[\"screw.s1.lead_m_per_turn\",\"screw.s2.lead_m_per_turn\"]}", "run.parameters=[\"l\"]"});
  // z and the angle turn freely: 4 rad/s of 0.1 kg m^2 and the mass that comes along keep their rate.
  CHECK(gradient(both, "cvodes-forward", both.parameters.values()).gradient[0] ==
        Approx(4 / (2 * std::numbers::pi)).epsilon(1e-6));
  // Both laws, c t^2 and -2 c t^2: psi = q_b(1) = -2 c.
  Problem laws = problem_of_case(
      "gear_and_two_drivers",
      {"parameter.c={numbers=[\"driver.a.law.coefficients[2]\",\"driver.b.law.coefficients[2]\"],factors=[1,-2]}",
       "run.parameters=[\"c\"]"});
  CHECK(gradient(laws, "cvodes-adjoint", laws.parameters.values()).gradient[0] == Approx(-2).epsilon(1e-6));
  take_notices();
}

TEST_CASE("held parameters: an equilibrium has no derivative by one of redundant links either") {
  Problem p = problem_of_case("three_cranks", {"start.given=[]"});
  Assembly assembly(p.mechanism, p.parameters);
  const auto rho = p.parameters.values();
  assembly.set_parameters(rho.data());
  CHECK_THROWS_WITH(find_equilibrium(assembly, 0, held_by_start(assembly), true),
                    Contains("'point.Q.y_m' cannot vary alone"));
  take_notices();
}
