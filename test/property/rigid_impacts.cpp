// Impacts of rigid contacts: times, costs and gradients against closed forms and an independent program.
#include <fmt/format.h>
#include <support/paths.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/rigid_scenes.h"
#include "property/ways_compared.h"
#include "support/with_words.h"

using namespace costate;
using costate::test::MethodWay;
using costate::test::with_words;

namespace {

const std::vector<MethodWay> impact_ways = {{"index1", "idas-adjoint"},
                                            {"index1", "idas-forward"},
                                            {"index1", "cvodes-adjoint"},
                                            {"index1", "cvodes-forward"},
                                            {"baumgarte", "idas-adjoint"},
                                            {"baumgarte", "cvodes-adjoint"},
                                            {"index2", "idas-adjoint"},
                                            {"index2", "idas-forward"},
                                            {"index3", "idas-adjoint"},
                                            {"penalty", "idas-forward"},
                                            {"penalty", "cvodes-adjoint"},
                                            {"augmented-lagrangian", "cvodes-adjoint"},
                                            {"augmented-lagrangian", "cvodes-forward"},
                                            {"maggi", "cvodes-adjoint"},
                                            {"maggi", "cvodes-forward"},
                                            {"maggi-implicit", "idas-adjoint"},
                                            {"maggi-implicit", "idas-forward"},
                                            {"index1", "hand-tangent"},
                                            {"index1", "hand-adjoint"},
                                            {"baumgarte", "hand-adjoint"},
                                            {"index2", "hand-tangent"},
                                            {"index2", "hand-adjoint"},
                                            {"penalty", "hand-tangent"},
                                            {"penalty-second-order", "hand-adjoint"},
                                            {"maggi", "hand-tangent"},
                                            {"maggi", "hand-adjoint"},
                                            {"maggi-implicit", "hand-adjoint"},
                                            {"maggi-second-order", "hand-adjoint"},
                                            {"index1", "discrete-tangent"},
                                            {"baumgarte", "discrete-adjoint"},
                                            {"penalty", "discrete-adjoint"},
                                            {"maggi", "discrete-tangent"},
                                            {"maggi", "discrete-adjoint"}};

}  // namespace

// The digits of an independent program (models/five_bar/README.md): eight behind the point of the gradient, nine of
// psi, times to six. Between methods 1e-7, at rtol 1e-11; the penalty's weight leaves O(1/alpha), some 1e-8.
TEST_CASE("rigid impacts: the five-bar over the ground, by every method", "[events]") {
  const double expected[] = {-0.37737314, -0.23636559, -0.29897679, -0.03933222};
  for (const MethodWay& way : impact_ways) {
    Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar_ground.toml"));
    p.formulation = way.formulation;
    p.solver.rtol = 1e-11;
    const GradientResult r = gradient(p, way.method, p.parameters.values());
    CAPTURE(way.formulation, way.method);
    REQUIRE(r.events.size() == 2);
    CHECK(std::abs(r.events[0].t - 0.283982) <= 6e-7);
    CHECK(std::abs(r.events[1].t - 0.869464) <= 6e-7);
    CHECK(std::abs(r.psi - 0.059992313) <= 1e-9);
    for (std::size_t j = 0; j < 4; ++j) {
      CAPTURE(j, r.gradient[j]);
      CHECK(std::abs(r.gradient[j] - expected[j]) <= 4e-8);
    }
  }
}

// A ball dropped from h bounces at T_k = t1 (1 + 2 (e + ... + e^(k-1))), t1 = sqrt(2 h/g), and flies off with e^k g t1.
// Between impacts the motion is a parabola, which integrators solve to rounding at any tolerance; at 1e-10 the gradient
// has ten digits, and the sum over five impacts eight.
TEST_CASE("rigid impacts: a dropped ball", "[events]") {
  const double g = 9.81, e = 0.8, h = 1, end = 2.8, t1 = std::sqrt(2 * h / g);
  for (const MethodWay& way : {MethodWay{"index1", "cvodes-adjoint"}, MethodWay{"index1", "idas-forward"},
                               MethodWay{"index2", "idas-adjoint"}, MethodWay{"maggi", "cvodes-forward"}}) {
    Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/drop.toml"));
    p.formulation = way.formulation;
    p.objective.running.clear();
    const GradientResult r = gradient(p, way.method, p.parameters.values());
    CAPTURE(way.formulation, way.method);
    REQUIRE(r.events.size() == 5);
    double sum = 0, slope = 0;  // e + ... + e^(k-1) and its derivative
    double lost = 0;
    for (int k = 1; k <= 5; ++k) {
      CHECK(std::abs(r.events[static_cast<std::size_t>(k - 1)].t - t1 * (1 + 2 * sum)) <= 1e-9);
      const double speed = std::pow(e, k - 1) * g * t1;
      lost = 0.5 * (1 - e * e) * speed * speed;
      CHECK(std::abs(r.events[static_cast<std::size_t>(k - 1)].energy_lost - lost) <= 1e-8);
      CHECK(r.events[static_cast<std::size_t>(k - 1)].mode == "bounces");
      if (k == 5) break;
      sum += std::pow(e, k);
      slope += k * std::pow(e, k - 1);
    }
    const double tau = end - t1 * (1 + 2 * sum), v = std::pow(e, 5) * g * t1, t1_h = t1 / (2 * h);
    CHECK(std::abs(r.psi - (v * tau - 0.5 * g * tau * tau)) <= 1e-8);
    const double by_tau = v - g * tau;
    const double by_h = std::pow(e, 5) * g * t1_h * tau - by_tau * t1_h * (1 + 2 * sum);
    const double by_e = 5 * std::pow(e, 4) * g * t1 * tau - by_tau * t1 * 2 * slope;
    CHECK(std::abs(r.gradient[0] - by_h) <= 1e-7);
    CHECK(std::abs(r.gradient[1] - by_e) <= 1e-7);
    CHECK(std::abs(r.gradient[2] - (1 - by_h)) <= 1e-7);  // ball and ground together: everything rises
  }
}

namespace {

// Two discs of a bar that hangs on a spring over a slope, each of which strikes at its own times.
const char* swinging = R"(
[gravity]
y_m_per_s2 = -9.81
[body.bar]
x_m = 0.1
y_m = 1.2
angle_rad = 0
angular_velocity_rad_per_s = -1
mass_kg = 2
inertia_kg_m2 = 0.3
center_x_m = 0.1
[point.left]
on = "bar"
x_m = -0.5
y_m = 0
[point.right]
on = "bar"
x_m = 0.6
y_m = 0.05
[spring.S]
from = "pin"
to = "left"
stiffness_N_per_m = 40
damping_N_s_per_m = 0.5
natural_length_m = 0.8
[point.pin]
ground = true
x_m = -1
y_m = 1.5
[contact.left]
kind = "rigid"
point = "left"
restitution = 0.6
closing_speed_m_per_s = 0
radius_m = 0.1
ground_angle_rad = 0.1
[contact.right]
kind = "rigid"
point = "right"
restitution = 0.8
closing_speed_m_per_s = 0
radius_m = 0.05
ground_angle_rad = 0.1
[start]
given = ["bar.x", "bar.y", "bar.angle"]
[run]
t_end_s = 1.2
rtol = 1e-11
parameters = ["contact.left.restitution", "contact.right.restitution", "contact.left.radius_m", "contact.right.ground_angle_rad", "body.bar.mass_kg", "body.bar.inertia_kg_m2", "body.bar.center_x_m", "point.right.x_m", "spring.S.stiffness_N_per_m", "gravity.y_m_per_s2"]
[[cost.running]]
kind = "square"
output = "bar.x"
target = 0.4
[[cost.terminal]]
kind = "value"
output = "bar.angle"
)";

}  // namespace

// Against Richardson differences of whole motions, whose own estimate is some 1e-8 of the largest scaled component.
TEST_CASE("rigid impacts: gradients through impacts of several contacts", "[events]") {
  Problem p = make_problem(Scene::parse(swinging, "swinging.toml"));
  p.formulation = "index1";
  const std::vector<double> rho = p.parameters.values();
  const GradientResult reference = gradient(p, "differences", rho);
  double size = 0;
  for (std::size_t j = 0; j < rho.size(); ++j)
    size = std::max(size, std::abs(reference.gradient[j] * p.parameters.parameters[j].scale));
  int of_left = 0, of_right = 0;
  for (const RunEvent& event : reference.events) (event.name == "contact.left: touch" ? of_left : of_right)++;
  CHECK(of_left == 1);
  CHECK(of_right == 3);
  for (const MethodWay& way : impact_ways) {
    p.formulation = way.formulation;
    const GradientResult r = gradient(p, way.method, rho);
    CAPTURE(way.formulation, way.method, r.events.size());
    CHECK(r.events.size() == 4);
    for (std::size_t j = 0; j < rho.size(); ++j) {
      CAPTURE(p.parameters.parameters[j].name, r.gradient[j], reference.gradient[j]);
      CHECK(std::abs(r.gradient[j] - reference.gradient[j]) * p.parameters.parameters[j].scale <= 1e-6 * size);
    }
  }
}

// Gradients through closing and opening against Richardson differences of whole motions (their own estimate: 1e-8).
TEST_CASE("rigid contacts: gradients through closing and opening", "[events]") {
  const std::string scene =
      with_words(test::kHopper, {{"FRICTION", ""}, {"GIVEN", "[\"foot.x\", \"top.x\", \"top.y\"]"}});
  Problem p = make_problem(Scene::parse(scene, "hopper.toml"));
  p.formulation = "index1";
  const std::vector<double> rho = p.parameters.values();
  const GradientResult reference = gradient(p, "differences", rho);
  double size = 0;
  for (std::size_t j = 0; j < rho.size(); ++j)
    size = std::max(size, std::abs(reference.gradient[j] * p.parameters.parameters[j].scale));
  for (const MethodWay& way : impact_ways) {
    p.formulation = way.formulation;
    CAPTURE(way.formulation, way.method);
    const GradientResult r = gradient(p, way.method, rho);
    REQUIRE(r.events.size() >= 2);
    CHECK(r.events[0].name == "contact.floor: release");
    CHECK(r.events[0].mode == "open");
    CHECK(r.events[1].name == "contact.floor: touch");
    CHECK(r.events[1].mode == "closed");
    for (std::size_t j = 0; j < rho.size(); ++j) {
      CAPTURE(p.parameters.parameters[j].name, r.gradient[j], reference.gradient[j]);
      CHECK(std::abs(r.gradient[j] - reference.gradient[j]) * p.parameters.parameters[j].scale <= 1e-6 * size);
    }
  }
}

// What is not there says so, and names the contact.
TEST_CASE("rigid contacts: refusals", "[events]") {
  Problem p = make_problem(
      Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/drop.toml", {"contact.floor.closing_speed_m_per_s=0"}));
  p.solver.t_end = 4.2;  // beyond the last bounce
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Catch::Contains("contact.floor.closing_speed_m_per_s"));
  CHECK_THROWS_WITH(gradient(p, "hand-adjoint", p.parameters.values()),
                    Catch::Contains("contact.floor.closing_speed_m_per_s"));
  // It closes where it is slower, and rests.
  p = make_problem(Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/drop.toml",
                               {"contact.floor.closing_speed_m_per_s=0.01", "run.t_end_s=4.5"}));
  const Simulation s = simulate(p, p.parameters.values());
  CHECK(s.events.back().mode == "closed");
  CHECK(s.events.back().t < 4.0637127688715781401);
  CHECK(std::abs(s.events.back().t - 4.0637127688715781401) <= 2 * 0.01 / 9.81 / (1 - 0.8));
  const std::string slips =
      with_words(test::kHopper, {{"FRICTION", "friction = \"coulomb\"\nfriction_coefficient = 0.05\nalong_m = 0"},
                                 {"GIVEN", "[\"top.x\", \"top.y\"]"}});
  p = make_problem(Scene::parse(slips, "hopper.toml"));
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Catch::Contains("contact.floor"));
}

// A ball that bounces infinitely many times until t1 (1 + e)/(1 - e) closes where that is no more to be seen, with
// 3e-5 of the first speed: 2 e v/(g (1 - e)) before. Until then heights are v0^3/(3 g^2) (1 + e^3)/(1 - e^3) s m, and
// all of its energy is taken. Behind it the ball rises with the ground, and with nothing else.
TEST_CASE("rigid contacts: bounces that die out close", "[events]") {
  const double g = 9.81, e = 0.8, v0 = std::sqrt(2 * g), end = 4.5, v = 3e-5 * v0;
  const double height = v0 * v0 * v0 / (3 * g * g) * (1 + e * e * e) / (1 - e * e * e), by_h = 1.5 * height;
  const double by_e = v0 * v0 * v0 / (3 * g * g) * 6 * e * e / std::pow(1 - e * e * e, 2);
  for (const MethodWay& way : {MethodWay{"index1", "cvodes-adjoint"}, MethodWay{"index1", "idas-forward"},
                               MethodWay{"baumgarte", "idas-adjoint"}, MethodWay{"index2", "idas-adjoint"},
                               MethodWay{"index1", "hand-tangent"}, MethodWay{"baumgarte", "hand-adjoint"},
                               MethodWay{"index2", "hand-adjoint"}, MethodWay{"index1", "discrete-adjoint"},
                               MethodWay{"maggi", "cvodes-adjoint"}, MethodWay{"maggi-implicit", "idas-forward"},
                               MethodWay{"maggi", "discrete-adjoint"}, MethodWay{"maggi", "hand-adjoint"},
                               MethodWay{"maggi-implicit", "hand-tangent"}}) {
    Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/drop.toml"));
    p.formulation = way.formulation;
    p.solver.t_end = end;
    take_notices();
    const GradientResult r = gradient(p, way.method, p.parameters.values());
    CAPTURE(way.formulation, way.method);
    REQUIRE(!r.events.empty());
    const RunEvent& last = r.events.back();
    CHECK(last.mode == "closed");
    CHECK(last.t < 4.0637127688715781401);
    CHECK(4.0637127688715781401 - last.t <= 2 * e * v / (g * (1 - e)) + 1e-7);
    double taken = 0;
    for (const RunEvent& at : r.events) taken += at.energy_lost;
    CHECK(std::abs(taken - g) <= 1e-7);
    CHECK(std::abs(r.psi - height) <= 1e-7);
    CHECK(std::abs(r.gradient[0] - by_h) <= 1e-6);
    CHECK(std::abs(r.gradient[1] - by_e) <= 1e-6 * by_e);
    CHECK(std::abs(r.gradient[2] - (1 + end - by_h)) <= 1e-6);
    std::string said;
    for (const auto& sentence : take_notices()) said += sentence;
    CHECK_THAT(said, Catch::Contains("At t = 4.063") && Catch::Contains("contact.floor") &&
                         Catch::Contains("(once 4.43)") && Catch::Contains(" J."));
  }
}

// A bar falls flat on both its ends: with restitution it comes back flat, without it rests on both, half its weight on
// each. There is no gradient through impacts of one instant, and that is said; the run is as exact as any.
TEST_CASE("rigid contacts: two that strike in one instant", "[events]") {
  const std::string scene = R"(
[gravity]
y_m_per_s2 = -9.81
[body.bar]
x_m = 0
y_m = 0.5
mass_kg = 3
inertia_kg_m2 = 0.4
[point.left]
on = "bar"
x_m = -0.5
y_m = 0
[point.right]
on = "bar"
x_m = 0.5
y_m = 0
[contact.left]
kind = "rigid"
point = "left"
restitution = E
[contact.right]
kind = "rigid"
point = "right"
restitution = E
[start]
given = ["bar.x", "bar.y", "bar.angle"]
[run]
t_end_s = 0.5
rtol = 1e-11
formulation = "index1"
parameters = ["body.bar.mass_kg"]
[[cost.terminal]]
kind = "value"
output = "OUTPUT"
)";
  const double fall = std::sqrt(2 * 0.5 / 9.81), speed = 9.81 * fall;
  for (const double e : {0.0, 0.6}) {
    Problem p = make_problem(
        Scene::parse(with_words(scene, {{"= E", fmt::format("= {}", e)}, {"OUTPUT", "bar.y_dot"}}), "bar.toml"));
    const Simulation s = simulate(p, p.parameters.values());
    CAPTURE(e, s.psi);
    REQUIRE(s.events.size() == 1);
    CHECK(std::abs(s.events[0].t - fall) <= 1e-9);
    CHECK(std::abs(s.events[0].energy_lost - 0.5 * 3 * (1 - e * e) * speed * speed) <= 1e-8);
    CHECK(std::abs(s.psi - (e > 0 ? e * speed - 9.81 * (0.5 - fall) : 0)) <= 1e-8);
    CHECK_THROWS_WITH(gradient(p, "cvodes-adjoint", p.parameters.values()), Catch::Contains("same time"));
  }
  for (const char* foot : {"left", "right"}) {
    Problem p = make_problem(Scene::parse(
        with_words(scene, {{"= E", "= 0"}, {"OUTPUT", fmt::format("{}.normal_force", foot)}}), "bar.toml"));
    CHECK(std::abs(simulate(p, p.parameters.values()).psi - 1.5 * 9.81) <= 1e-8);
  }
}
