// Fixed steps that end before their time: at events, at the run's own end, at places of laws that parameters move. The
// gradient is that of the psi which the steps form, to rounding, whatever the step, and psi is of second order across
// cuts.
//
// Tolerances. kSums: tangent and adjoint are the same sums in another order; a cut divides by the length of its step,
// which costs a digit or two of the 1e-14 of discrete.cpp. kDifferences: psi carries rounding errors of some 1e-14 of
// itself, so that extrapolated differences over 2e-4 of a parameter's scale are good to 1e-10; over that range no cut
// passes one of the grid's times, where psi has a kink of the size of the steps' own errors.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/fixed_run.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/driven_carriage.h"
#include "property/gradient_compare.h"
#include "support/cases.h"
#include "support/paths.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

namespace {

constexpr double kSums = 1e-10, kDifferences = 1e-9;

// A bar that falls onto a floor with its end, which gives way or not.
std::string falling_arm(const std::string& contact) {
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
{}
ground_height_m = 0.75
[start]
given = ["P.y"]
[run]
t_end_s = 1
[[cost.running]]
kind = "square"
output = "P.y_dot"
[[cost.running]]
kind = "value"
output = "arm.tension"
weight = 1e-2
[[cost.terminal]]
kind = "value"
output = "P.x"
)",
                     contact);
}
constexpr const char* kSoft = "law = \"hunt-crossley\"\nrestitution = 0.8\nstiffness_N_per_m_n = 2e4";
constexpr const char* kViscous = "law = \"kelvin-voigt\"\nstiffness_N_per_m_n = 2e4\ndamping_N_s_per_m = 20";
constexpr const char* kRigid = "kind = \"rigid\"\nrestitution = 0.6\nclosing_speed_m_per_s = 0";

// A ball on rigid ground: it falls, bounces, closes, and is lifted off again by a force of time.
const std::string kLifted = R"(
[gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0.3
vx_m_per_s = 0.5
[mass.m]
point = "P"
mass_kg = 2
[force.F]
point = "P"
formula_y_N = "a*t^3"
a = 45
[contact.floor]
kind = "rigid"
point = "P"
restitution = 0.2
closing_speed_m_per_s = 0.3
ground_height_m = 0.05
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 1.1
[[cost.running]]
kind = "square"
output = "P.y"
[[cost.running]]
kind = "square"
output = "floor.normal_force"
weight = 1e-3
[[cost.terminal]]
kind = "value"
output = "P.y"
)";

Problem fixed_problem(const std::string& scene, const std::vector<std::string>& numbers, double step,
                      const char* scheme = "newmark") {
  Problem p = make_problem(Scene::parse(scene, "scene.toml"), numbers);
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  p.solver.step_s = step;
  p.formulation_options.set("discrete_scheme", scheme);
  p.formulation_options.set("discrete_rho_infinity", 0.7);
  return p;
}

std::vector<double> differences_of_steps(const Problem& p, double part = 2e-4) {
  std::vector<double> g;
  for (std::size_t j = 0; j < p.parameters.parameters.size(); ++j) {
    const double scale = p.parameters.parameters[j].scale;
    const auto along = [&](double e) {
      auto rho = p.parameters.values();
      rho[j] += e * scale;
      return simulate(p, rho).psi;
    };
    g.push_back(directional_difference(along, part) / scale);
  }
  return g;
}

/// The gradient that the tangent gives, which is the adjoint's and psi's own.
GradientResult exact_gradient(const Problem& p, double sums = kSums, double differences = kDifferences) {
  const auto rho = p.parameters.values();
  const GradientResult tangent = gradient(p, "discrete-tangent", rho), adjoint = gradient(p, "discrete-adjoint", rho);
  CHECK(tangent.integrator == "fixed");
  CHECK(tangent.psi == adjoint.psi);
  CHECK(tangent.psi == simulate(p, rho).psi);
  const auto transposed = gradient_mismatch(adjoint.gradient, tangent.gradient, p.parameters);
  INFO("adjoint and tangent " << transposed.text);
  CHECK(transposed.error <= sums);
  const auto own = gradient_mismatch(tangent.gradient, differences_of_steps(p), p.parameters);
  INFO("tangent and differences " << own.text);
  CHECK(own.error <= differences);
  return tangent;
}

const std::vector<std::string> kArm = {"contact.floor.ground_height_m", "gravity.y_m_per_s2", "bar.arm.length_m",
                                       "bar.arm.mass_kg"};

std::vector<std::string> arm_numbers(const std::vector<std::string>& own) {
  std::vector<std::string> all = kArm;
  for (const std::string& n : own) all.push_back("contact.floor." + n);
  return all;
}

}  // namespace

TEST_CASE("fixed cuts: touches and releases, by the derivative of the steps", "[events][discrete]") {
  for (const char* scheme : {"newmark", "generalized-alpha"}) {
    CAPTURE(scheme);
    Problem p = fixed_problem(falling_arm(kSoft), arm_numbers({"stiffness_N_per_m_n", "restitution"}), 0.0031, scheme);
    CHECK(exact_gradient(p).events.size() == 6);
    p = fixed_problem(falling_arm(kViscous), arm_numbers({"stiffness_N_per_m_n", "damping_N_s_per_m"}), 0.0031, scheme);
    CHECK(exact_gradient(p).events.size() >= 4);
  }
}

TEST_CASE("fixed cuts: impacts, by the derivative of the steps", "[events][discrete]") {
  for (const char* scheme : {"newmark", "generalized-alpha"}) {
    CAPTURE(scheme);
    const Problem p = fixed_problem(falling_arm(kRigid), arm_numbers({"restitution"}), 0.013, scheme);
    const GradientResult r = exact_gradient(p);
    CHECK(r.events.size() >= 3);
    CHECK(r.events[0].mode == "bounces");
    CHECK(r.events[0].energy_lost > 0);
  }
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar_ground.toml"));
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  p.solver.step_s = 0.02;
  CHECK(exact_gradient(p).events.size() == 2);
}

// The release is where the ground's own force is zero: a guard by the multipliers of the step's end.
TEST_CASE("fixed cuts: contacts that close and open, by the derivative of the steps", "[events][discrete]") {
  for (const char* scheme : {"newmark", "generalized-alpha"}) {
    CAPTURE(scheme);
    const Problem p = fixed_problem(kLifted,
                                    {"force.F.a", "point.P.y_m", "contact.floor.ground_height_m", "mass.m.mass_kg",
                                     "contact.floor.restitution", "gravity.y_m_per_s2"},
                                    0.013, scheme);
    const GradientResult r = exact_gradient(p);
    REQUIRE(r.events.size() >= 3);
    CHECK(r.events.back().name == "contact.floor: release");
    CHECK(r.events.back().mode == "open");
    // N = m g - a t^3 is zero.
    CHECK(r.events.back().t == Approx(std::cbrt(2 * 9.81 / 45)).epsilon(1e-12));
  }
}

// Laws of time in a driver, in a force and in the costs: what the steps say of explicit time at an event's own time.
TEST_CASE("fixed cuts: drivers and laws of time across events", "[events][discrete]") {
  std::string scene = falling_arm(kRigid);
  scene += R"(
[[cost.running]]
kind = "square"
output = "P.x"
target = { kind = "sine", amplitude = 0.6, angular_frequency_rad_per_s = 7 }
[point.Q]
x_m = 0.2
y_m = 1.3
[mass.Q]
point = "Q"
mass_kg = 0.4
[driver.up]
coordinate = "Q.y"
law = { kind = "sine", amplitude = 0.3, angular_frequency_rad_per_s = 5, phase_rad = 1 }
[distance_driver.reel]
from = "A"
to = "Q"
law = { kind = "sine", amplitude = 0.1, angular_frequency_rad_per_s = 4, offset = 0.6 }
[spring.s]
from = "Q"
to = "P"
stiffness_N_per_m = 30
natural_length_m = 0.5
[force.wind]
point = "P"
formula_y_N = "b*sin(9*t)"
b = 2
)";
  for (const auto& [from, to] :
       {std::pair("[distance_driver.reel]\nfrom = \"A\"\nto = \"Q\"\nlaw = { kind = \"sine\", amplitude = 0.1, "
                  "angular_frequency_rad_per_s = 4, offset = 0.6 }\n",
                  "")})
    if (const auto at = scene.find(from); at != std::string::npos) scene.replace(at, std::string(from).size(), to);
  scene.replace(scene.find("given = [\"P.y\"]"), 15, "given = [\"P.y\", \"Q.x\"]");
  for (const char* scheme : {"newmark", "generalized-alpha"}) {
    CAPTURE(scheme);
    const Problem p = fixed_problem(
        scene,
        arm_numbers({"restitution"}), 0.011, scheme);
    CHECK(exact_gradient(p).events.size() >= 3);
  }
}

// The end of the run is one of the steps' own; its time is a cost, and the level a parameter.
TEST_CASE("fixed cuts: runs that end by an event, by the derivative of the steps", "[free_end][discrete]") {
  const auto swing = [](const std::string& end, const std::string& costs) {
    return fmt::format(R"(
[gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0
[mass.bob]
point = "P"
mass_kg = 1
[bar.rod]
from = "O"
to = "P"
mass_kg = 0
length_m = 1.3
[angle.swing]
bar = "rod"
angle_rad = -0.3
[start]
given = ["swing.angle"]
[run]
t_end_s = 3
ends_when = {{ {} }}
[[cost.terminal]]
kind = "value"
output = "time"
{})",
                       end, costs);
  };
  const std::string costs =
      "[[cost.running]]\nkind = \"square\"\noutput = \"P.y\"\ntarget = { kind = \"sine\", amplitude = 0.6, "
      "angular_frequency_rad_per_s = 7 }\n[[cost.running]]\nkind = \"value\"\noutput = \"rod.tension\"\nweight = "
      "0.1\n[[cost.terminal]]\nkind = \"square\"\noutput = \"P.y_ddot\"\nweight = 0.01\n";
  for (const char* scheme : {"newmark", "generalized-alpha"})
    for (const char* end : {"output = \"P.x\", below = 0.2", "output = \"P.x_dot\", below = -2.0",
                            "output = \"P.y_ddot\", above = 0.5", "output = \"time\", above = 0.777"}) {
      CAPTURE(scheme, end);
      const Problem p =
          fixed_problem(swing(end, costs), {"bar.rod.length_m", "gravity.y_m_per_s2", "angle.swing.angle_rad"}, 0.03,
                        scheme);
      const GradientResult r = exact_gradient(p);
      REQUIRE(r.end);
      CHECK(r.end->t < 3);
    }
  const Problem never =
      fixed_problem(swing("output = \"P.x\", above = 2.0", ""), {"bar.rod.length_m"}, 0.03);
  CHECK_THROWS_WITH(simulate(never, never.parameters.values()), Contains("never comes"));
}

TEST_CASE("fixed cuts: an event and then the run's end, by the derivative of the steps", "[free_end][discrete]") {
  std::string scene = falling_arm(kRigid);
  scene.replace(scene.find("t_end_s = 1"), 11, "t_end_s = 2\nends_when = { output = \"P.y_dot\", below = -0.4 }");
  scene.replace(scene.find("given = [\"P.y\"]"), 15, "given = [\"P.y\"]\n");
  scene += "[[cost.terminal]]\nkind = \"value\"\noutput = \"time\"\n";
  scene.replace(scene.find("y_dot\", below = -0.4"), 20, "x\", above = 0.99999");
  Problem p = fixed_problem(scene, arm_numbers({"restitution"}), 0.013);
  p.ends_when = std::make_shared<EndEvent>(*p.ends_when);
  const GradientResult r = exact_gradient(p);
  CHECK(r.end);
}

TEST_CASE("fixed cuts: places of laws that parameters move", "[discrete]") {
  const auto of_law = [](std::vector<std::string> names) {
    for (std::string& name : names) name = "driver.push.law." + name;
    names.emplace_back("body.rod.mass_kg");
    return names;
  };
  const std::vector<std::pair<const char*, std::vector<std::string>>> laws = {
      {R"({ kind = "bump", height_m = 0.15, start_m = 0.3041, length_m = 0.5, shape = "half_sine" })",
       of_law({"start_m", "length_m", "height_m"})},
      {R"({ kind = "bump", height_m = 0.2, start_m = 0.1041, length_m = 0.3 })", of_law({"start_m", "length_m"})},
      {R"({ kind = "sine_sweep", amplitude_m = 0.08, start_m = 0.3541, length_m = 0.6, n_start_1_per_m = 0.8, n_end_1_per_m = 2 })",
       of_law({"start_m", "length_m"})}};
  for (const char* scheme : {"newmark", "generalized-alpha"})
    for (const char* cost : {"rod.angle", "rod.angle_ddot"})
      for (const auto& [law, parameters] : laws) {
        CAPTURE(scheme, cost, law);
        std::string text = driven_carriage(law);
        text.replace(text.find("output = \"rod.angle\""), 20, fmt::format("output = \"{}\"", cost));
        exact_gradient(fixed_problem(text, parameters, 0.02, scheme));
      }
  // Forces that are switched at times, also within an actuator's state.
  for (const char* name : {"switched_actuator"})
    for (const char* scheme : {"newmark", "generalized-alpha"}) {
      CAPTURE(name, scheme);
      Problem p = problem_of_case(name, {"actuator.g.command_N.breaks=[0.7041]"});
      p.formulation = "index3";
      p.solver.integrator = "fixed";
      p.solver.step_s = 0.02;
      p.formulation_options.set("discrete_scheme", scheme);
      exact_gradient(p);
    }
}

// A driver's kink at a time that stands is a cut, too.
TEST_CASE("fixed cuts: kinks of drivers", "[discrete]") {
  const char* law = R"({ kind = "bump", height_m = 0.15, start_m = 0.3, length_m = 0.5, shape = "half_sine" })";
  const Problem p = fixed_problem(driven_carriage(law), {"spring.strut.stiffness_N_per_m", "driver.push.law.height_m"},
                                  0.02);
  const GradientResult r = exact_gradient(p);
  CHECK(r.counters.jumps == 2);
}

// Events in the times of the grid, in one instant, at the start.
TEST_CASE("fixed cuts: events in the grid's own times and in one instant", "[events][discrete]") {
  // Two balls, let go at rest, touch at t = 0.5 s, but for rounding; one of them next to it.
  const auto balls = [](double second) {
    const double h = 0.5 * 9.81 * 0.25;
    std::string text = "[gravity]\ny_m_per_s2 = -9.81\n";
    std::string given;
    for (const auto& [name, height] : {std::pair("a", h), std::pair("b", h * second)}) {
      text += fmt::format(
          "[point.{0}]\nx_m = {2}\ny_m = {1:.17g}\n[mass.{0}]\npoint = \"{0}\"\nmass_kg = 1\n[contact.{0}]\nkind = "
          "\"rigid\"\npoint = \"{0}\"\nrestitution = 0.7\nclosing_speed_m_per_s = 0\n[[cost.terminal]]\nkind = "
          "\"square\"\noutput = \"{0}.y\"\n[[cost.running]]\nkind = \"square\"\noutput = \"{0}.y_dot\"\n",
          name, height, name[0] - 'a');
      given += fmt::format("{}\"{}.x\", \"{}.y\"", given.empty() ? "" : ", ", name, name);
    }
    return text + fmt::format("[start]\ngiven = [{}]\n[run]\nt_end_s = 0.9\n", given);
  };
  for (const double step : {0.1, 0.05, 0.03}) {
    CAPTURE(step);
    // Where both depend on parameters of their own, the other's event moves nothing of the one.
    const Problem together = fixed_problem(balls(1), {"point.a.y_m", "point.b.y_m", "contact.a.restitution"}, step),
                  apart = fixed_problem(balls(1.3), {"point.a.y_m", "point.b.y_m", "contact.a.restitution"}, step);
    const GradientResult t = gradient(together, "discrete-tangent", together.parameters.values()),
                         a = gradient(together, "discrete-adjoint", together.parameters.values()),
                         other = gradient(apart, "discrete-adjoint", apart.parameters.values());
    CHECK(t.events.size() == 2);
    CHECK(gradient_mismatch(a.gradient, t.gradient, together.parameters).error <= kSums);
    // Between impacts the motion is a parabola, which the steps meet; psi's running part is by the trapezoidal rule.
    CHECK(t.gradient[0] == Approx(other.gradient[0]).epsilon(3 * step * step));
    CHECK(t.gradient[2] == Approx(other.gradient[2]).epsilon(3 * step * step));
  }
}

// Of second order: half the step divides the error by four, where events lie in other places of their steps each time.
TEST_CASE("fixed cuts: psi and its gradient are of second order across cuts", "[events][discrete]") {
  struct Case {
    std::string scene;
    std::vector<std::string> numbers;
    double step;
  };
  std::string ended = falling_arm(kRigid);
  ended.replace(ended.find("t_end_s = 1"), 11, "t_end_s = 2\nends_when = { output = \"arm.tension\", above = 25 }");
  for (const Case& c : {Case{falling_arm(kRigid), arm_numbers({"restitution"}), 0.02},
                        Case{falling_arm(kSoft), arm_numbers({"stiffness_N_per_m_n"}), 0.0008},
                        Case{kLifted, {"force.F.a", "point.P.y_m", "mass.m.mass_kg"}, 0.02}}) {
    Problem reference = make_problem(Scene::parse(c.scene, "scene.toml"), c.numbers);
    reference.formulation = "index1";
    reference.solver.rtol = 1e-11;
    reference.solver.confirm = false;
    const auto rho = reference.parameters.values();
    const GradientResult exact = gradient(reference, "cvodes-forward", rho);
    for (const char* scheme : {"newmark", "generalized-alpha"}) {
      std::vector<double> psi, slopes;
      for (const double part : {1.0, 0.5, 0.25, 0.125}) {
        const Problem p = fixed_problem(c.scene, c.numbers, c.step * part, scheme);
        const GradientResult r = gradient(p, "discrete-adjoint", rho);
        CHECK(r.events.size() == exact.events.size());
        psi.push_back(std::abs(r.psi / exact.psi - 1));
        slopes.push_back(gradient_mismatch(r.gradient, exact.gradient, p.parameters).error);
      }
      CAPTURE(c.scene, scheme, psi, slopes);
      // Over three halvings 64, less what the places of events make of single ones.
      CHECK(psi.front() / psi.back() >= 25);
      CHECK(slopes.front() / slopes.back() >= 25);
      CHECK(psi.back() <= 1e-3);
    }
  }
}

TEST_CASE("fixed cuts: an adjoint goes back over cuts from checkpoints", "[events][discrete]") {
  for (const std::string& scene : {falling_arm(kSoft), falling_arm(kRigid)}) {
    Problem p = fixed_problem(scene, kArm, 0.0031);
    const auto rho = p.parameters.values();
    const GradientResult whole = gradient(p, "discrete-adjoint", rho);
    for (const long segment : {1L, 7L, 40L}) {
      CAPTURE(segment);
      p.solver.checkpoint_steps = segment;
      const GradientResult r = gradient(p, "discrete-adjoint", rho);
      CHECK(r.counters.checkpoints > 1);
      CHECK(r.psi == whole.psi);
      // Steps that are taken again begin Newton's iteration elsewhere.
      CHECK(gradient_mismatch(r.gradient, whole.gradient, p.parameters).error <= 1e-9);
    }
  }
}
