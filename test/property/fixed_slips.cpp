// Fixed steps through rigid contacts in space whose slip turns: the gradient is that of the psi which the steps form,
// to rounding (fixed_scenes.h), also where the slip stops, and both tend to those of the motion with the square of the
// step.
#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "property/fixed_scenes.h"
#include "property/sliding_in_space.h"
#include "support/paths.h"

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
  // As steps come near the stop their projection leaves the slip alone: psi jumps by 1e-11 where one begins to.
  const GradientResult rolls = exact_gradient(made({{"END", "0.6"}}), kSums, 1e-6);
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

// It begins in the direction of the friction before, and turns: without the derivative of that direction gradients were
// 3e-5 to 9e-4 off. What differences leave here: that direction's rounding, 1e-16 of the velocities by an offset of
// 1e-9 m/s, in what the first steps make of it.
TEST_CASE("fixed slips: a slip from rest turns, by the derivative of the steps", "[events][discrete]") {
  constexpr double of_direction = 1e-7;
  for (const char* scheme : {"newmark", "generalized-alpha"})
    for (const auto& [end, events] : {std::pair{"0.9", 1}, {"1.9", 3}}) {
      CAPTURE(scheme, end);
      const GradientResult r = exact_gradient(
          fixed_problem(sliding_point({{"FRICTION", "0.5"},
                                       {"CONTACT", "closed = true\nalong_m = 0\nacross_m = 0\nground_angle_rad = 0.03"},
                                       {"GIVEN", ""},
                                       {"END", end},
                                       {"PARAMETERS", "\"mass.P.mass_kg\""},
                                       {"MORE",
                                        "[force.push]\npoint = \"P\"\nk = 14\nformula_x_N = \"k*sin(2.2*t)\"\n"
                                        "formula_y_N = \"7*sin(4*t)\""}}),
                        {"contact.floor.friction_coefficient", "contact.floor.ground_angle_rad", "mass.P.mass_kg",
                         "force.push.k"},
                        0.01, scheme),
          of_direction, of_direction);
      CHECK(static_cast<int>(r.events.size()) == events);
      CHECK(r.events[0].name == "contact.floor: slip");
    }
}

TEST_CASE("fixed slips: a slip from rest, against its closed form", "[events][discrete]") {
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
  const double m = 2, tau = 0.9 - 0.5 * m * 9.81 / 20, x = 20 * tau * tau * tau / (6 * m),
               slope = -x / m - 20 * tau * tau / (2 * m) * 0.5 * 9.81 / 20;
  std::vector<double> off, slopes;
  for (const double step : {0.02, 0.005, 0.00125}) {
    const GradientResult r = gradient(made(step), "discrete-adjoint", made(step).parameters.values());
    off.push_back(std::abs(r.psi - x));
    slopes.push_back(std::abs(r.gradient[0] - slope));
  }
  CAPTURE(off, slopes);
  // Of second order, 256, wherever in a step the slip begins.
  CHECK(off[0] / off[2] > 60);
  CHECK(off[2] < 1e-5 * x);
  CHECK(slopes[2] < 1e-5 * std::abs(slope));
  CHECK(slopes[0] / slopes[2] > 60);
}

TEST_CASE("fixed slips: what begins to slide from rest as another contact does is refused", "[events][discrete]") {
  // Q is drawn by a spring from P until it slides; behind that P, which had stopped, slides on from rest.
  const std::string two = R"toml([gravity]
z_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0
z_m = 0
[mass.P]
point = "P"
mass_kg = 2
[force.push]
point = "P"
formula_x_N = "18.1438*t*cos(2.889*t)"
formula_y_N = "4.484*sin(2.889*t)"
[contact.floor]
kind = "rigid"
point = "P"
friction = "coulomb"
friction_coefficient = 0.1607
closed = true
along_m = 0
across_m = 0
[point.Q]
x_m = 0.7
y_m = 0.2
z_m = 0
[mass.Q]
point = "Q"
mass_kg = 1.5
[contact.second]
kind = "rigid"
point = "Q"
friction = "coulomb"
friction_coefficient = 0.3996
closed = true
along_m = 0.7
across_m = 0.2
[spring.s]
from = "P"
to = "Q"
stiffness_N_per_m = 141.406
natural_length_m = 0.7280109889
[start]
given = []
[run]
t_end_s = 1.481
parameters = ["mass.P.mass_kg"]
[[cost.terminal]]
kind = "value"
output = "Q.y"
)toml";
  const Problem p = fixed_problem(two, {"mass.P.mass_kg"}, 0.01);
  for (const char* method : {"discrete-tangent", "discrete-adjoint"})
    CHECK_THROWS_WITH(gradient(p, method, p.parameters.values()),
                      Contains("contact.floor begins to slide in space from rest"));
}

// Projections that left all slips alone took impulses along the ground that are none of friction: steps were of first
// order beside joints, 2.1e-4 off at 1e-3 s.
TEST_CASE("fixed slips: psi is of second order beside a joint", "[events][discrete]") {
  constexpr double exact = 0.79734620;  // maggi on cvodes, baumgarte on idas, rtol 1e-12
  std::vector<double> off;
  for (const double step : {4e-3, 2e-3, 1e-3}) {
    Problem p = make_problem(Scene::load(COSTATE_SOURCE_DIR "/test/cases/rough_pendulum.toml"));
    p.formulation = "index3";
    p.solver.integrator = "fixed";
    p.solver.step_s = step;
    off.push_back(std::abs(simulate(p, p.parameters.values()).psi - exact));
  }
  CAPTURE(off);
  CHECK(off[0] / off[1] > 3);
  CHECK(off[1] / off[2] > 3);
  CHECK(off[2] < 1e-5);
}
