// What starts exactly where it would let go, slip or be caught: on neither side of its limit.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;

namespace {

/// A mass on the ground, pulled by forces of time.
Problem pulled(const std::string& force, const std::string& friction, const std::string& output, bool in_space) {
  return make_problem(
      Scene::parse(fmt::format(R"toml(
[gravity]
{3}_m_per_s2 = -10
[point.P]
x_m = 0
y_m = 0
{4}
[mass.m]
point = "P"
mass_kg = 1
[contact.c]
kind = "rigid"
point = "P"
closed = true
{1}
[force.f]
point = "P"
{0}
[start]
given = ["P.x"{5}]
{6}
[[cost.terminal]]
kind = "value"
output = "{2}"
[run]
t_end_s = 1
rtol = 1e-9
parameters = ["mass.m.mass_kg"]
)toml",
                               force, friction, output, in_space ? "z" : "y", in_space ? "z_m = 0" : "",
                               in_space ? ", \"P.y\"" : "", friction.empty() ? "" : "given_velocities = []"),
                   "pulled.toml"));
}

void check_psi(Problem p, double psi) {
  for (const Formulation& f : formulations()) {
    p.formulation = f.name;
    p.solver.integrator.clear();
    CAPTURE(f.name);
    Simulation s;
    try {
      s = simulate(p, p.parameters.values());
    } catch (const CapabilityError&) {  // rolling and the like, by name
      continue;
    }
    // The penalties' constraints are soft: 1/alpha.
    CHECK(std::abs(s.psi - psi) <= (f.exact_constraints() ? 1e-6 : 1e-4) * std::abs(psi));
    REQUIRE(s.events.size() == 1);
    CHECK(s.events[0].t < 2e-4);  // t^2 is 1e-9 of 10 N at 1e-4 s, from where on it is more than rounding
    take_notices();
  }
}

}  // namespace

// The normal force begins at zero and would pull: y'' = 6t. The friction begins at mu N and would be more: x'' = t.
// They held to the end, with -6 N and 3.5 N of 2.5 N, by all formulations alike.
TEST_CASE("rigid contacts: what begins at its limit goes beyond it", "[events]") {
  const std::string friction = "friction = \"coulomb\"\nfriction_coefficient = 0.25";
  const auto polynomial = [](const char* axis, const char* coefficients) {
    return fmt::format("{}_N = {{ kind = \"polynomial\", coefficients = [{}] }}", axis, coefficients);
  };
  check_psi(pulled(polynomial("y", "10, 6"), "", "P.y", false), 1);
  check_psi(pulled(polynomial("x", "2.5, 1"), friction, "P.x", false), 1.0 / 6);
  check_psi(pulled(polynomial("x", "-2.5, -1"), friction, "P.x", false), -1.0 / 6);
  check_psi(pulled(polynomial("x", "2.5, 0, 1"), friction, "P.x", false), 1.0 / 12);
  check_psi(pulled(polynomial("x", "2.5, 1"), friction, "P.x", true), 1.0 / 6);
  check_psi(pulled(polynomial("z", "10, 6"), "", "P.z", true), 1);
  // With more mass it lets go later: dpsi/dm = -int (1 - t)(10 + 6 t) dt = -6.
  const Problem lifted = pulled(polynomial("y", "10, 6"), "", "P.y", false);
  for (const char* method : {"idas-adjoint", "idas-forward", "cvodes-adjoint", "hand-adjoint"}) {
    CAPTURE(method);
    CHECK(gradient(lifted, method, lifted.parameters.values()).gradient[0] == Approx(-6).epsilon(1e-4));
    take_notices();
  }
}

// What rests at its limit and does not go beyond it stays: nothing pulls, or less.
TEST_CASE("rigid contacts: what stays at its limit", "[events]") {
  for (const char* coefficients : {"10", "10, -6"}) {
    Problem p =
        pulled(fmt::format("y_N = {{ kind = \"polynomial\", coefficients = [{}] }}", coefficients), "", "P.y", false);
    for (const Formulation& f : formulations()) {
      p.formulation = f.name;
      CAPTURE(f.name, coefficients);
      const Simulation s = simulate(p, p.parameters.values());
      CHECK(std::abs(s.psi) < 1e-7);
      CHECK(s.events.empty());
      take_notices();
    }
  }
}

// At rest at its angle, with gravity to turn it away at once: IDAS's rounding caught it there.
TEST_CASE("latch: at rest at its angle, moving away", "[events]") {
  Problem p = problem_of_case("latch_at_its_angle");
  for (const Formulation& f : formulations()) {
    p.formulation = f.name;
    p.solver.integrator.clear();
    CAPTURE(f.name);
    const Simulation s = simulate(p, p.parameters.values());
    CHECK(s.events.empty());
    // By DOP853 at 1e-12.
    CHECK(s.psi == Approx(-5.70505923782).epsilon(f.exact_constraints() ? 1e-6 : 1e-4));
    take_notices();
  }
}
