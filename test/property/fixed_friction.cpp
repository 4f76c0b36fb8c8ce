// Fixed steps through rigid contacts with friction that close, stick, slide and let go: the gradient is that of the psi
// which the steps form, to rounding (fixed_scenes.h), and both tend to those of the motion with the square of the step.
#include "costate/base/error.h"
#include "property/fixed_scenes.h"
#include "property/rigid_scenes.h"
#include "property/rough_box.h"
#include "support/paths.h"
#include "support/with_words.h"

using namespace costate;
using namespace costate::test;

namespace {

std::string rods(const char* friction) {
  return with_words(
      kRods, {{"CONTACT", fmt::format("friction = \"coulomb\"\nfriction_coefficient = {}", friction)}, {"END", "1.2"}});
}

const std::vector<std::string> kOfRods = {"contact.floor.ground_angle_rad",
                                          "contact.floor.friction_coefficient",
                                          "body.lower.mass_kg",
                                          "body.upper.inertia_kg_m2",
                                          "point.tip.x_m",
                                          "gravity.y_m_per_s2"};
const std::vector<std::string> kOfBlock = {"mass.block.mass_kg",
                                           "spring.S.stiffness_N_per_m",
                                           "spring.S.damping_N_s_per_m",
                                           "contact.floor.ground_angle_rad",
                                           "contact.floor.friction_coefficient",
                                           "gravity.y_m_per_s2",
                                           "point.puller.x_m"};

}  // namespace

TEST_CASE("fixed friction: what sticks, slides and lets go, by the derivative of the steps", "[events][discrete]") {
  for (const char* scheme : {"newmark", "generalized-alpha"}) {
    CAPTURE(scheme);
    CHECK(exact_gradient(fixed_problem(kPulledBlock, kOfBlock, 0.013, scheme)).events.size() >= 3);
    // The tip slides to and fro, slides until it sticks, and sticks where it lands.
    for (const auto& [friction, modes] : std::vector<std::pair<const char*, std::vector<std::string>>>{
             {"0.1", {"slides", "slides"}}, {"2.0", {"slides", "sticks"}}, {"5.0", {"closed"}}}) {
      CAPTURE(friction);
      const GradientResult r = exact_gradient(fixed_problem(rods(friction), kOfRods, 0.013, scheme));
      std::vector<std::string> found;
      for (const RunEvent& event : r.events) found.push_back(event.mode);
      CHECK(found == modes);
    }
  }
}

TEST_CASE("fixed friction: a ball that slides until it rolls", "[events][discrete]") {
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/thrown.toml"));
  p.parameters = p.mechanism->select({"speed", "friction", "inertia", "slope"});
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  p.solver.step_s = 0.03;
  const GradientResult r = exact_gradient(p);
  REQUIRE(r.events.size() == 1);
  CHECK(r.events[0].mode == "sticks");
  // Between, velocities are straight, which steps of the trapezoidal rule have exactly.
  CHECK(std::abs(r.events[0].t - 2 * 2 / (7 * 0.2 * 9.81)) < 1e-12);
  CHECK(std::abs(r.psi - 1.511785142) < 1e-9);
}

TEST_CASE("fixed friction: psi and its gradient are of second order", "[events][discrete]") {
  struct Case {
    std::string scene;
    std::vector<std::string> numbers;
  };
  for (const Case& c : {Case{kPulledBlock, kOfBlock}, Case{rods("0.1"), kOfRods}, Case{rods("2.0"), kOfRods},
                        Case{rods("5.0"), kOfRods}}) {
    Problem reference = make_problem(Scene::parse(c.scene, "scene.toml"), c.numbers);
    reference.formulation = "index1";
    reference.solver.confirm = false;
    const auto rho = reference.parameters.values();
    const GradientResult exact = gradient(reference, "cvodes-forward", rho);
    std::vector<double> psi, slopes;
    for (const double step : {0.008, 0.002, 0.0005}) {
      const Problem p = fixed_problem(c.scene, c.numbers, step);
      const GradientResult r = gradient(p, "discrete-adjoint", rho);
      CHECK(r.events.size() == exact.events.size());
      psi.push_back(std::abs(r.psi / exact.psi - 1));
      slopes.push_back(gradient_mismatch(r.gradient, exact.gradient, p.parameters).error);
    }
    CAPTURE(c.scene, psi, slopes);
    CHECK(psi.front() / psi.back() >= 100);
    CHECK(slopes.front() / slopes.back() >= 100);
    CHECK(slopes.back() <= 1e-4);
  }
}

// Two corners hold a box twice along the ground: such rows give, by 2.5e-10 s^2/kg of what they bear.
TEST_CASE("fixed friction: a box on two corners slides to rest, or begins to slide", "[events][discrete]") {
  const auto fixed = [](Problem p, double step) {
    p.formulation = "index3";
    p.solver.integrator = "fixed";
    p.solver.step_s = step;
    return p;
  };
  const std::string slides = "sliding = \"forward\"";
  const auto slid = [&](double step) {
    return fixed(make_box({{"SPEED", "1"},
                           {"LEFT", slides},
                           {"RIGHT", slides},
                           {"VELOCITIES", ""},
                           {"START", "body.box.vx_m_per_s"}}),
                 step);
  };
  const auto pushed = [&](double step) {
    return fixed(make_box({{"MORE", "[force.push]\npoint = \"c\"\nformula_x_N = \"4*t\""}, {"END", "2"}}), step);
  };
  // x = v^2/(2 mu g), quadratic in time: exact, but for what gives.
  const GradientResult r = exact_gradient(slid(0.017));
  CHECK(std::abs(r.psi - 0.7 - 1 / (2 * 0.3 * 9.81)) < 1e-8);
  CHECK(exact_gradient(pushed(0.017)).events.size() == 2);
  // x = k tau^3/(6 m).
  const double k = 4, m = 2, tau = 2 - 0.3 * m * 9.81 / k, x = 0.7 + k * tau * tau * tau / (6 * m);
  std::vector<double> off;
  for (const double step : {0.02, 0.01, 0.005})
    off.push_back(std::abs(gradient(pushed(step), "discrete-adjoint", pushed(step).parameters.values()).psi - x));
  CAPTURE(off);
  CHECK(off[0] / off[2] > 12);
}

// Nothing is driven here: a law of a force that jumps while the block slides moves no velocity.
TEST_CASE("fixed friction: a force's law jumps while a contact slides", "[events][discrete]") {
  const std::string scene = R"(
[gravity]
y_m_per_s2 = -9.81
[point.wall]
ground = true
x_m = -1
y_m = 0
[point.M]
x_m = 0
y_m = 0
[mass.M]
point = "M"
mass_kg = 1.5
[spring.S]
from = "wall"
to = "M"
stiffness_N_per_m = 60
natural_length_m = 1
damping_N_s_per_m = 0.4
[force.F]
point = "M"
x_N = { kind = "piecewise", breaks = [1.5], coefficients = [[0, 6], [0, 6.5]], joins = "none" }
[contact.floor]
kind = "rigid"
point = "M"
friction = "coulomb"
friction_coefficient = 0.3
static_coefficient = 0.5
closed = true
[start]
given = ["M.x"]
given_velocities = []
[run]
t_end_s = 2.2
[[cost.terminal]]
kind = "value"
output = "M.x"
)";
  const GradientResult r = exact_gradient(fixed_problem(
      scene, {"force.F.x_N.breaks[0]", "contact.floor.friction_coefficient", "spring.S.stiffness_N_per_m"}, 0.013,
      "newmark"));
  REQUIRE(r.events.size() == 2);  // slips at 1.23 s, stops at 1.83 s
  CHECK(r.events[0].t < 1.5);
  CHECK(r.events[1].t > 1.5);
  CHECK(std::abs(r.gradient[0]) > 1e-3);
}
