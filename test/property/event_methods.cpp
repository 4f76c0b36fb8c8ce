// Events by the methods that are not IDAS's or CVODES's own: the hand-derived equations of every formulation, and the
// discrete methods of the explicit schemes, across touches, impacts and the closing of rigid contacts.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "property/gradient_compare.h"
#include "support/paths.h"

using namespace costate;
using Catch::Contains;

namespace {

// A bar that falls onto a floor with its end, two times within the run, with bristles between them: constraints that a
// parameter moves, states that jump and states that go on, costs on the force that jumps.
std::string arm(const std::string& law) {
  return fmt::format(R"(
[gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 1
[point.P]
x_m = 1
y_m = 1
[bar.arm]
from = "A"
to = "P"
mass_kg = 1
length_m = 1
[contact.floor]
point = "P"
stiffness_N_per_m_n = 2e4
{}
ground_height_m = 0.75
friction = "lugre"
friction_coefficient = 0.1
bristle_stiffness_per_m = 300
[start]
given = ["P.y"]
[run]
t_end_s = 1
[[cost.running]]
kind = "square"
output = "P.y_dot"
[[cost.running]]
kind = "value"
output = "floor.normal_force"
weight = 1e-3
[[cost.terminal]]
kind = "value"
output = "P.x"
)",
                     law);
}

/// Those of this file, of formulations that have them; without fixed steps.
std::vector<std::pair<std::string, std::string>> ways() {
  std::vector<std::pair<std::string, std::string>> all;
  for (const auto& f : formulations())
    for (const auto& m : sensitivity_methods()) {
      using Needs = SensitivityMethod::Needs;
      const bool hand = m.needs == Needs::hand_tangent || m.needs == Needs::hand_adjoint,
                 steps = m.needs == Needs::discrete && f.make_ode;
      if ((hand || steps) && refusal(m, f).empty()) all.emplace_back(f.name, m.name);
    }
  return all;
}

}  // namespace

// Against the forward sensitivities of IDAS, whose own error here is 3e-9 of the largest scaled component at rtol 1e-11
// (by differences of runs). Each touch is a fresh start on a force that is not smooth there, and costs some 1e4 rtol; the
// gradient of a penalty differs by O(1/alpha), 1e-8; index 3 is good to what its refinements tell.
TEST_CASE("events: hand-derived and explicit discrete methods across touches", "[events]") {
  for (const auto& [law, number] : {std::pair{"law = \"kelvin-voigt\"\ndamping_N_s_per_m = 20", "damping_N_s_per_m"},
                                    {"law = \"hunt-crossley\"\nrestitution = 0.8", "restitution"}}) {
    Problem p = make_problem(Scene::parse(arm(law), "arm.toml"),
                             {"contact.floor.stiffness_N_per_m_n", std::string("contact.floor.") + number,
                              "contact.floor.ground_height_m", "contact.floor.friction_coefficient",
                              "gravity.y_m_per_s2", "bar.arm.length_m", "bar.arm.mass_kg"});
    p.solver.rtol = 1e-11;
    p.solver.confirm = false;
    p.formulation = "index1";
    const std::vector<double> rho = p.parameters.values();
    const GradientResult expected = gradient(p, "idas-forward", rho);
    REQUIRE(expected.events.size() >= 3);
    for (const auto& [formulation, method] : ways()) {
      CAPTURE(law, formulation, method);
      p.formulation = formulation;
      const GradientResult r = gradient(p, method, rho);
      CHECK(std::abs(r.psi - expected.psi) <= 1e-8 * std::abs(expected.psi));
      CHECK(r.events.size() == expected.events.size());
      const auto mismatch = test::gradient_mismatch(r.gradient, expected.gradient, p.parameters);
      INFO(mismatch.text);
      CHECK(mismatch.error <= 1e-7);
    }
  }
}
