// Fixed steps through rigid contacts in space whose slip turns: the gradient is that of the psi which the steps form,
// to rounding (fixed_scenes.h), also where the slip stops, and both tend to those of the motion with the square of the
// step.
#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "property/fixed_scenes.h"
#include "property/sliding_in_space.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

namespace {

/// A block thrown obliquely up a slope, or let fall onto it: it slides, turns and stops.
std::string block(const char* height, const std::string& contact, const char* given, const char* end) {
  return sliding_point(
      {{"HEIGHT", height},
       {"VX", "1"},
       {"VY", "2"},
       {"FRICTION", "0.5"},
       {"CONTACT", "ground_angle_rad = 0.3\n" + contact},
       {"GIVEN", given},
       {"END", end},
       {"MORE", "[[cost.running]]\nkind = \"value\"\noutput = \"floor.friction_force\"\nweight = 0.02"}});
}
const std::vector<std::string> kOfBlock = {"contact.floor.friction_coefficient", "contact.floor.ground_angle_rad",
                                           "mass.P.mass_kg", "point.P.vx_m_per_s", "gravity.z_m_per_s2"};
const char* const kSlides = "closed = true\nsliding = \"forward\"";

}  // namespace

TEST_CASE("fixed slips: a slip that turns, and stops, by the derivative of the steps", "[events][discrete]") {
  for (const char* scheme : {"newmark", "generalized-alpha"})
    for (const char* end : {"0.3", "0.8"}) {
      CAPTURE(scheme, end);
      const GradientResult r =
          exact_gradient(fixed_problem(block("0", kSlides, R"("P.x", "P.y")", end), kOfBlock, 0.013, scheme));
      CHECK(r.events.size() == (std::string(end) == "0.8" ? 1 : 0));
    }
}

TEST_CASE("fixed slips: a block that lands slides on, or bounces, by the derivative of the steps",
          "[events][discrete]") {
  for (const auto& [bounces, end] : {std::pair{"", "0.9"}, {"restitution = 0.5\nclosing_speed_m_per_s = 0", "0.25"}}) {
    CAPTURE(bounces);
    const GradientResult r =
        exact_gradient(fixed_problem(block("0.05", bounces, R"("P.x", "P.y", "P.z")", end), kOfBlock, 0.017));
    CHECK(r.events.size() >= 2);
  }
}

TEST_CASE("fixed slips: a ball that slides until it rolls, or bounces, by the derivative of the steps",
          "[events][discrete]") {
  const std::vector<std::string> numbers = {"contact.floor.friction_coefficient", "rigid_body.ball.mass_kg",
                                            "rigid_body.ball.inertia_yy_kg_m2", "rigid_body.ball.vx_m_per_s"};
  const auto made = [&](const SceneWords& words) { return fixed_problem(loaded_ball(words), numbers, 0.007); };
  const GradientResult rolls = exact_gradient(made({{"END", "0.6"}}));
  REQUIRE(rolls.events.size() == 1);
  CHECK(rolls.events[0].mode == "sticks");
  CHECK(exact_gradient(made({{"HEIGHT", "0.3"},
                             {"STATE", "restitution = 0.5\nclosing_speed_m_per_s = 0"},
                             {"GIVEN", R"(given = ["ball"])"},
                             {"END", "0.4"}}))
            .events.size() == 1);
}

TEST_CASE("fixed slips: psi and its gradient are of second order", "[events][discrete]") {
  for (const std::string& scene :
       {block("0", kSlides, R"("P.x", "P.y")", "0.3"), block("0", kSlides, R"("P.x", "P.y")", "0.8")}) {
    Problem reference = make_problem(Scene::parse(scene, "scene.toml"), kOfBlock);
    reference.formulation = "index1";
    reference.solver.confirm = false;
    const auto rho = reference.parameters.values();
    const GradientResult exact = gradient(reference, "cvodes-forward", rho);
    std::vector<double> psi, slopes;
    for (const double step : {0.008, 0.002, 0.0005}) {
      const Problem p = fixed_problem(scene, kOfBlock, step);
      const GradientResult r = gradient(p, "discrete-adjoint", rho);
      CHECK(r.events.size() == exact.events.size());
      psi.push_back(std::abs(r.psi / exact.psi - 1));
      slopes.push_back(gradient_mismatch(r.gradient, exact.gradient, p.parameters).error);
    }
    CAPTURE(scene, psi, slopes);
    CHECK(psi.front() / psi.back() >= 100);
    CHECK(slopes.front() / slopes.back() >= 100);
    CHECK(slopes.back() <= 1e-4);
  }
}

TEST_CASE("fixed slips: a slip from rest has a motion, and its gradient is refused by name", "[events][discrete]") {
  // Pushed by k t along x it sticks until mu m g/k: x = k tau^3/(6 m).
  const auto made = [](double step) {
    return fixed_problem(sliding_point({{"FRICTION", "0.5"},
                                        {"CONTACT", "closed = true\nalong_m = 0\nacross_m = 0"},
                                        {"GIVEN", ""},
                                        {"END", "0.9"},
                                        {"PARAMETERS", "\"mass.P.mass_kg\""},
                                        {"MORE", "[force.push]\npoint = \"P\"\nk = 20\nformula_x_N = \"k*t\""}}),
                         {"mass.P.mass_kg"}, step);
  };
  const double tau = 0.9 - 0.5 * 2 * 9.81 / 20, x = 20 * tau * tau * tau / (6 * 2);
  std::vector<double> off;
  for (const double step : {0.02, 0.01, 0.005})
    off.push_back(std::abs(simulate(made(step), made(step).parameters.values()).psi - x));
  CAPTURE(off);
  CHECK(off[0] / off[2] > 10);
  CHECK(off[2] < 1e-4 * x);
  for (const char* method : {"discrete-tangent", "discrete-adjoint"})
    CHECK_THROWS_WITH(gradient(made(0.01), method, made(0.01).parameters.values()),
                      Contains("sliding in space begins from rest"));
}
