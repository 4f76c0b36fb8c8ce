// Rigid contacts with Coulomb friction: sliding, sticking and impacts against closed forms, gradients against these and
// against Richardson differences of whole motions.
#include <fmt/format.h>
#include <support/paths.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/rigid_scenes.h"
#include "property/ways_compared.h"
#include "support/with_words.h"

using namespace costate;
using costate::test::check_ways;
using costate::test::event_names;
using costate::test::MethodWay;
using costate::test::with_words;

namespace {

const std::vector<MethodWay> sliding_ways = {{"index1", "idas-adjoint"},
                                             {"index1", "idas-forward"},
                                             {"index1", "cvodes-adjoint"},
                                             {"index1", "cvodes-forward"},
                                             {"index2", "idas-adjoint"},
                                             {"index2", "idas-forward"},
                                             {"index3", "idas-adjoint"},
                                             {"baumgarte", "idas-adjoint"},
                                             {"baumgarte", "cvodes-adjoint"},
                                             {"penalty", "idas-forward"},
                                             {"penalty", "cvodes-adjoint"},
                                             {"augmented-lagrangian", "cvodes-adjoint"},
                                             {"augmented-lagrangian", "cvodes-forward"},
                                             {"maggi", "cvodes-adjoint"},
                                             {"maggi", "cvodes-forward"},
                                             {"maggi-implicit", "idas-adjoint"},
                                             {"maggi-implicit", "idas-forward"},
                                             {"maggi-second-order", "cvodes-adjoint"},
                                             {"maggi", "discrete-tangent"},
                                             {"maggi-implicit", "discrete-adjoint"},
                                             {"index1", "hand-tangent"},
                                             {"index1", "hand-adjoint"},
                                             {"baumgarte", "hand-adjoint"},
                                             {"penalty", "hand-tangent"},
                                             {"index2", "hand-tangent"},
                                             {"index2", "hand-adjoint"},
                                             {"maggi", "hand-tangent"},
                                             {"maggi", "hand-adjoint"},
                                             {"maggi-implicit", "hand-tangent"},
                                             {"maggi-implicit", "hand-adjoint"},
                                             {"augmented-lagrangian", "hand-adjoint"},
                                             {"index1", "discrete-tangent"},
                                             {"baumgarte", "discrete-adjoint"},
                                             {"penalty", "discrete-adjoint"},
                                             {"index2", "discrete-adjoint"}};

}  // namespace

// Without spin it slides with -mu g, and turns with m mu g r/I, until v + r w = 0 at t* = v0/(mu g (1 + m r^2/I)),
// which for a solid sphere is 2 v0/(7 mu g); behind it rolls at v0/(1 + I/(m r^2)) = 5/7 v0. A quadratic in time, which
// integrators solve to rounding; times and gradients are off by the tolerance 1e-10, taken tenfold, and of penalty by
// 1/alpha.
TEST_CASE("rigid friction: a ball that slides until it rolls", "[events]") {
  const double v0 = 2, mu = 0.2, g = 9.81, end = 1, k = 0.4;  // I/(m r^2)
  const double stop = v0 / (mu * g * (1 + 1 / k)), rolls = v0 / (1 + k);
  CHECK(std::abs(stop - 2 * v0 / (7 * mu * g)) <= 1e-15);
  const double x = v0 * stop - 0.5 * mu * g * stop * stop + rolls * (end - stop);
  // x = v0 t* - mu g t*^2/2 + v0/(1 + k) (T - t*); by t* the terms cancel, as the velocity does not jump.
  const double by_v0 = stop + (end - stop) / (1 + k);
  const double by_mu = -0.5 * g * stop * stop;
  const double by_k = -v0 / ((1 + k) * (1 + k)) * (end - stop);
  for (const MethodWay& way : sliding_ways) {
    Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/thrown.toml"));
    p.parameters = p.mechanism->select({"speed", "friction", "inertia"});
    p.formulation = way.formulation;
    const GradientResult r = gradient(p, way.method, p.parameters.values());
    CAPTURE(way.formulation, way.method);
    REQUIRE(event_names(r.events) == std::vector<std::string>{"contact.floor: stop sticks"});
    CHECK(std::abs(r.events[0].t - stop) <= 1e-9);
    CHECK(std::abs(r.psi - x) <= 1e-8);
    CHECK(std::abs(r.gradient[0] - by_v0) <= 1e-7);
    CHECK(std::abs(r.gradient[1] - by_mu) <= 1e-7);
    CHECK(std::abs(r.gradient[2] - by_k / (0.6 * 0.01)) <= 1e-5);  // per kg m^2: 0.006 kg m^2 are 1
  }
}

namespace {

const char* block = R"(
[gravity]
y_m_per_s2 = -9.81
[point.block]
x_m = 0
y_m = 0
vx_m_per_s = SPEED
[mass.block]
point = "block"
mass_kg = 2
[contact.slope]
kind = "rigid"
point = "block"
closed = true
SLIDING
ground_angle_rad = 0.5
friction = "coulomb"
friction_coefficient = FRICTION
[start]
given = GIVEN
[run]
t_end_s = 0.6
rtol = 1e-10
parameters = ["contact.slope.friction_coefficient", "mass.block.mass_kg"]
[[cost.terminal]]
kind = "value"
output = "block.x"
)";

}  // namespace

// Up the slope with -g (sin b + mu cos b) until t*; with mu < tan b it comes down with -g (sin b - mu cos b), otherwise
// it stays. Quadratic in time: to rounding but for the tolerance.
TEST_CASE("rigid friction: a block on a slope comes to rest, or slides back", "[events]") {
  const double g = 9.81, b = 0.5, end = 0.6, s = std::sin(b), c = std::cos(b), u0 = 1 / c;
  for (const double mu : {0.3, 0.7}) {
    const double up = g * (s + mu * c), stop = u0 / up, rest = end - stop;
    const double down = mu < std::tan(b) ? g * (s - mu * c) : 0;
    const double along = 0.5 * u0 * stop - 0.5 * down * rest * rest;
    // The way up is u0^2/(2 up); dt*/dmu = -stop g c/up.
    const double by_mu =
        -0.5 * u0 * stop * g * c / up + (down > 0 ? 0.5 * g * c * rest * rest - down * rest * stop * g * c / up : 0);
    const std::string scene = with_words(block, {{"SPEED", "1"},
                                                 {"SLIDING", "sliding = \"forward\""},
                                                 {"GIVEN", "[\"block.x\"]"},
                                                 {"FRICTION", fmt::format("{}", mu)}});
    for (const MethodWay& way : sliding_ways) {
      Problem p = make_problem(Scene::parse(scene, "block.toml"));
      p.formulation = way.formulation;
      const GradientResult r = gradient(p, way.method, p.parameters.values());
      CAPTURE(mu, way.formulation, way.method);
      REQUIRE(event_names(r.events) ==
              std::vector<std::string>{mu < std::tan(b) ? "contact.slope: stop slides" : "contact.slope: stop sticks"});
      CHECK(std::abs(r.events[0].t - stop) <= 1e-9);
      CHECK(std::abs(r.psi - along * c) <= 1e-8);
      CHECK(std::abs(r.gradient[0] - by_mu * c) <= 1e-7);
      CHECK(std::abs(r.gradient[1]) <= 1e-7);
    }
  }
}

// A start that is not a motion is refused by name: what does not slide the way it says, and what slides where it is
// said to stick.
TEST_CASE("rigid friction: starts that are none", "[events]") {
  const auto refused = [](const std::string& speed, const std::string& sliding, const std::string& given,
                          const std::string& mu) -> std::string {
    try {
      Problem p = make_problem(
          Scene::parse(with_words(block, {{"SPEED", speed}, {"SLIDING", sliding}, {"GIVEN", given}, {"FRICTION", mu}}),
                       "block.toml"));
      p.formulation = "index1";
      gradient(p, "cvodes-forward", p.parameters.values());
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  CHECK_THAT(refused("-1", "sliding = \"forward\"", "[\"block.x\"]", "0.3"),
             Catch::Matchers::Contains("slides the other way"));
  CHECK_THAT(refused("0", "sliding = \"forward\"", "[\"block.x\"]", "0.3"),
             Catch::Matchers::Contains("does not slide so"));
  CHECK_THAT(refused("0", "along_m = 0", "[]", "0.3"), Catch::Matchers::Contains("sliding"));
  CHECK(refused("0", "along_m = 0", "[]", "0.7").empty());
  CHECK(refused("0", "sliding = \"backward\"", "[\"block.x\"]", "0.3").empty());
}

// Costs of positions, of the friction force along the way and of the normal force at the end, whose derivatives take
// the transposed system with its corner; against Richardson differences, whose own estimate is 1e-8.
TEST_CASE("rigid friction: gradients through sticking and sliding", "[events]") {
  Problem p = make_problem(Scene::parse(test::kPulledBlock, "pulled.toml"));
  const GradientResult r = gradient(p, "cvodes-forward", p.parameters.values());
  CAPTURE(event_names(r.events));
  CHECK(r.events.size() >= 3);
  p.formulation = "index1";
  check_ways(p, event_names(r.events), sliding_ways, 1e-6);
}

namespace {

const char* kLands = R"([gravity]
y_m_per_s2 = -9.81
[body.box]
x_m = 0
y_m = 0.3
angle_rad = 0.3
mass_kg = 1
inertia_kg_m2 = 0.02
[point.foot]
on = "box"
x_m = 0
y_m = -0.2
[contact.foot]
kind = "rigid"
point = "foot"
friction = "coulomb"
friction_coefficient = FRICTION
ground_height_m = 0.01
ground_angle_rad = SLOPE
restitution = 0
ANCHOR
[point.top]
on = "box"
x_m = 0
y_m = 0.2
[spring.S]
from = "top"
to = "anchor"
stiffness_N_per_m = 30
natural_length_m = 0.5
[start]
given = ["box.x", "box.y", "box.angle"]
[run]
t_end_s = 0.6
rtol = 1e-10
formulation = "index1"
parameters = ["spring.S.stiffness_N_per_m", "point.foot.x_m", "point.foot.y_m", "body.box.angle_rad", "body.box.mass_kg", "contact.foot.ground_height_m", "contact.foot.friction_coefficient"]
[[cost.terminal]]
kind = "value"
output = "box.x"
[[cost.running]]
kind = "square"
output = "box.y_ddot"
[[cost.running]]
kind = "value"
output = "lambda.contact.foot.normal"
)";

// By a bump from 0.45 to 0.55 s, with kinks at both.
const char* kAnchorThatIsPushed = R"([point.anchor]
x_m = 0.8
y_m = 0.5
[mass.anchor]
point = "anchor"
mass_kg = 0.4
[driver.across]
coordinate = "anchor.x"
law = 0.8
[driver.up]
coordinate = "anchor.y"
law = { kind = "sum", terms = [{ kind = "polynomial", coefficients = [0.5] }, { kind = "bump", height_m = 0.05, start_m = 0.45, length_m = 0.1, shape = "half_sine" }] }
)";

/// `costs` in the place of words of the costs.
Problem lands(const char* friction, const char* slope,
              const char* anchor = "[point.anchor]\nground = true\nx_m = 0.8\ny_m = 0.5",
              const std::vector<std::pair<std::string, std::string>>& costs = {}) {
  return make_problem(Scene::parse(
      with_words(with_words(kLands, {{"FRICTION", friction}, {"SLOPE", slope}, {"ANCHOR", anchor}}), costs),
      "lands.toml"));
}

}  // namespace

// A foot lands and slides, or sticks where it lands, which depends on the parameters as all does that follows; or it
// lands on a slope of 45 degrees with mu = 1, sticks, slips and lets go. There what slides is pushed along the
// coordinate that is best to be left out of the independent ones: the reactions have others. Differences are known to
// 1e-8.
TEST_CASE("rigid friction: where a foot lands depends on the parameters", "[events]") {
  check_ways(lands("0.4", "0"), {"contact.foot: touch slides", "contact.foot: release open"}, sliding_ways, 1e-6);
  check_ways(lands("3", "0"), {"contact.foot: touch closed"}, sliding_ways, 1e-6);
  // Its place goes on where the velocity of what the spring hangs on jumps.
  check_ways(lands("3", "0", kAnchorThatIsPushed), {"contact.foot: touch closed"}, sliding_ways, 1e-6);
  Problem p = lands("1", "0.785");
  p.formulation = "augmented-lagrangian";
  p.solver.t_end = 0.45;  // before it lands again
  check_ways(p, {"contact.foot: touch closed", "contact.foot: slip slides", "contact.foot: release open"},
             {{"index1", "cvodes-adjoint"},
              {"maggi", "cvodes-adjoint"},
              {"maggi", "cvodes-forward"},
              {"maggi-implicit", "idas-adjoint"},
              {"maggi-implicit", "idas-forward"},
              {"maggi", "discrete-adjoint"},
              {"maggi-implicit", "discrete-tangent"},
              {"maggi", "hand-adjoint"},
              {"maggi-implicit", "hand-tangent"}},
             1e-6);
}

// The adjoint of second order, which takes no running costs of accelerations and reactions: the row along the ground
// has a rate while a body turns and slides, and keeps no place where it sticks.
TEST_CASE("rigid friction: the adjoint of second order of a foot that lands", "[events]") {
  const std::vector<std::pair<std::string, std::string>> costs = {
      {"output = \"box.y_ddot\"", "output = \"box.y\""},
      {"output = \"lambda.contact.foot.normal\"", "output = \"box.angle_dot\""}};
  const char* anchor = "[point.anchor]\nground = true\nx_m = 0.8\ny_m = 0.5";
  const std::vector<MethodWay> ways = {
      {"penalty", "hand-adjoint"}, {"penalty-second-order", "hand-adjoint"}, {"maggi-second-order", "hand-adjoint"}};
  for (const char* pushed : {anchor, kAnchorThatIsPushed})
    check_ways(lands("3", "0", pushed, costs), {"contact.foot: touch closed"}, ways, 1e-6);
  check_ways(lands("0.4", "0", anchor, costs), {"contact.foot: touch slides", "contact.foot: release open"}, ways,
             1e-6);
  Problem p = lands("1", "0.785", anchor, costs);
  p.formulation = "augmented-lagrangian";
  p.solver.t_end = 0.45;  // before it lands again
  check_ways(p, {"contact.foot: touch closed", "contact.foot: slip slides", "contact.foot: release open"}, ways, 1e-6);
}

// Where a run ends by a reaction the end's own time has that reaction's rate, in which the friction of what slides
// turns with the body. Without that the gradient was off by a quarter.
TEST_CASE("rigid friction: a run that ends by the normal force of what slides", "[events]") {
  Problem p = make_problem(Scene::parse(R"([gravity]
y_m_per_s2 = -9.81
[body.rod]
x_m = 0
y_m = 0.8
vx_m_per_s = 3
angle_rad = 0.4
mass_kg = 1.5
inertia_kg_m2 = 0.1
[point.tip]
on = "rod"
x_m = 0.3
y_m = -0.7
[contact.floor]
kind = "rigid"
point = "tip"
closed = true
sliding = "forward"
friction = "coulomb"
friction_coefficient = 0.3
[start]
given = ["rod.angle", "rod.x"]
[run]
t_end_s = 1
rtol = 1e-11
ends_when = { output = "floor.normal_force", above = 9 }
parameters = ["body.rod.mass_kg", "body.rod.inertia_kg_m2", "contact.floor.friction_coefficient", "body.rod.angle_rad"]
[[cost.terminal]]
kind = "value"
output = "rod.angle"
[[cost.terminal]]
kind = "value"
output = "time"
)",
                                        "rod.toml"));
  p.formulation = "index1";
  const GradientResult r = gradient(p, "cvodes-forward", p.parameters.values());
  check_ways(p, event_names(r.events),
             {{"index1", "idas-adjoint"},
              {"index1", "cvodes-adjoint"},
              {"index2", "idas-adjoint"},
              {"baumgarte", "cvodes-forward"},
              {"penalty", "idas-forward"},
              {"augmented-lagrangian", "cvodes-adjoint"},
              {"maggi", "cvodes-adjoint"},
              {"maggi-implicit", "idas-forward"}},
             1e-6);
}
