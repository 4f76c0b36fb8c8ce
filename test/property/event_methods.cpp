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
#include "property/falling_arm.h"
#include "property/gradient_compare.h"
#include "support/paths.h"

using namespace costate;
using Catch::Contains;

namespace {

std::string arm(const std::string& law) {
  return test::falling_arm("stiffness_N_per_m_n = 2e4\n" + law, 1, "floor.normal_force", 1e-3);
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

Problem arm_problem(const std::string& law, const std::vector<std::string>& numbers, double rtol) {
  std::vector<std::string> names = {"contact.floor.stiffness_N_per_m_n", "contact.floor.ground_height_m",
                                    "gravity.y_m_per_s2", "bar.arm.length_m", "bar.arm.mass_kg"};
  for (const std::string& n : numbers) names.push_back("contact.floor." + n);
  Problem p = make_problem(Scene::parse(arm(law), "arm.toml"), names);
  p.solver.rtol = rtol;
  p.solver.confirm = false;
  return p;
}

constexpr const char* kCrossley = "law = \"hunt-crossley\"\nrestitution = 0.8";
constexpr const char* kBristles =
    "law = \"kelvin-voigt\"\ndamping_N_s_per_m = 20\nfriction = \"lugre\"\nfriction_coefficient = 0.1\n"
    "bristle_stiffness_per_m = 300";

bool chooses_steps(const std::string& formulation, const std::string& method) {
  return method.starts_with("hand") && formulation != "index3";
}

}  // namespace

// Against the forward sensitivities of IDAS, which at rtol 1e-11 are within 3e-9 of differences of runs. Hand-derived
// passes that choose their steps are within 1e-8, a penalty's differ by O(1/alpha). Steps of others are the motion's
// own, or a grid's: the derivative of a force d^1.5 behind its touch, a square root, and the force's end at the release
// cost them digits: 5e-6, and 3e-5 of index 3.
TEST_CASE("events: hand-derived and explicit discrete methods across touches", "[events]") {
  Problem p = arm_problem(kCrossley, {"restitution"}, 1e-11);
  p.formulation = "index1";
  const std::vector<double> rho = p.parameters.values();
  const GradientResult expected = gradient(p, "idas-forward", rho);
  REQUIRE(expected.events.size() == 6);
  for (const auto& [formulation, method] : ways()) {
    CAPTURE(formulation, method);
    p.formulation = formulation;
    const GradientResult r = gradient(p, method, rho);
    CHECK(std::abs(r.psi - expected.psi) <= 1e-8 * std::abs(expected.psi));
    CHECK(r.events.size() == expected.events.size());
    const auto mismatch = test::gradient_mismatch(r.gradient, expected.gradient, p.parameters);
    INFO(mismatch.text);
    CHECK(mismatch.error <= (chooses_steps(formulation, method) ? 1e-7 : formulation == "index3" ? 1e-4 : 2e-5));
  }
}

// A force that jumps at the touch, and bristles that do at the release. Bristles turn round as good as with a kink,
// which passes with steps of their own resolve.
TEST_CASE("events: hand-derived methods across touches with bristles", "[events]") {
  Problem p = arm_problem(kBristles, {"damping_N_s_per_m", "friction_coefficient"}, 1e-11);
  p.formulation = "index1";
  const std::vector<double> rho = p.parameters.values();
  const GradientResult expected = gradient(p, "idas-forward", rho);
  REQUIRE(expected.events.size() == 3);
  for (const auto& [formulation, method] : ways()) {
    if (!chooses_steps(formulation, method)) continue;
    CAPTURE(formulation, method);
    p.formulation = formulation;
    if (formulation.ends_with("second-order") && method == "hand-adjoint") {
      CHECK_THROWS_WITH(gradient(p, method, rho), Contains("'contact.floor' has bristles"));
      continue;
    }
    const GradientResult r = gradient(p, method, rho);
    const auto mismatch = test::gradient_mismatch(r.gradient, expected.gradient, p.parameters);
    INFO(mismatch.text);
    CHECK(mismatch.error <= 1e-7);
  }
}

// Steps that end at events have the guard at zero there, and what crosses is a map and its transpose: tangent and
// adjoint are the same sums at any tolerance, as in explicit_schemes.cpp.
TEST_CASE("events: discrete tangent and adjoint across touches agree to rounding", "[events]") {
  for (const char* formulation : {"index1", "baumgarte", "maggi"})
    for (const char* scheme : {"dopri5", "dop853"}) {
      Problem p = arm_problem(kCrossley, {"restitution"}, 1e-5);
      p.formulation = formulation;
      p.solver.integrator = scheme;
      const std::vector<double> rho = p.parameters.values();
      const GradientResult tangent = gradient(p, "discrete-tangent", rho),
                           adjoint = gradient(p, "discrete-adjoint", rho);
      CAPTURE(formulation, scheme);
      CHECK(std::abs(tangent.psi - adjoint.psi) <= 1e-12 * std::abs(tangent.psi));
      CHECK(tangent.events.size() == 6);
      const auto mismatch = test::gradient_mismatch(adjoint.gradient, tangent.gradient, p.parameters);
      INFO(mismatch.text);
      CHECK(mismatch.error <= 1e-10);
    }
}

// Of what is without events index 3 takes its fixed steps; with them the scheme that is carried across, unasked.
TEST_CASE("events: discrete methods take a scheme that carries them", "[events]") {
  Problem p = arm_problem(kCrossley, {}, 1e-8);
  const std::vector<double> rho = p.parameters.values();
  p.formulation = "index3";
  const GradientResult own = gradient(p, "discrete-adjoint", rho);
  CHECK(own.integrator == "radau9");
  p.solver.integrator = "radau9";
  const GradientResult chosen = gradient(p, "discrete-adjoint", rho);
  CHECK(own.psi == chosen.psi);
  CHECK(own.gradient == chosen.gradient);
  Problem smooth = make_problem(Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar.toml"));
  smooth.formulation = "index3";
  CHECK(gradient(smooth, "discrete-adjoint", smooth.parameters.values()).integrator == "fixed");
}

// Four spokes strike one after the other, each closes and lets go of the one before it.
TEST_CASE("events: hand-derived and discrete methods over a rimless wheel", "[events]") {
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/rimless_wheel/rimless_wheel.toml"));
  p.formulation = "index1";
  const std::vector<double> rho = p.parameters.values();
  const double right = gradient(p, "cvodes-forward", rho).gradient[0];
  for (const char* method : {"hand-tangent", "hand-adjoint", "discrete-tangent", "discrete-adjoint"}) {
    CAPTURE(method);
    CHECK(gradient(p, method, rho).gradient[0] == Approx(right).epsilon(1e-5));
  }
  for (const char* formulation : {"penalty-second-order", "maggi-second-order"}) {
    CAPTURE(formulation);
    p.formulation = formulation;
    CHECK(gradient(p, "hand-adjoint", rho).gradient[0] == Approx(right).epsilon(1e-5));
  }
}
