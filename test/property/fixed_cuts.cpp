// Fixed steps that end before their time: at events, at the run's own end, at places of laws that parameters move. The
// gradient is that of the psi which the steps form, to rounding, whatever the step.
#include "costate/base/error.h"
#include "property/driven_carriage.h"
#include "property/fixed_scenes.h"
#include "property/free_pendulum.h"
#include "support/cases.h"
#include "support/paths.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

TEST_CASE("fixed cuts: touches and releases, by the derivative of the steps", "[events][discrete]") {
  for (const char* scheme : {"newmark", "generalized-alpha"}) {
    CAPTURE(scheme);
    Problem p = fixed_problem(falling_arm(kSoft), arm_numbers({"stiffness_N_per_m_n", "restitution"}), 0.0033, scheme);
    CHECK(exact_gradient(p).events.size() == 6);
    p = fixed_problem(falling_arm(kViscous), arm_numbers({"stiffness_N_per_m_n", "damping_N_s_per_m"}), 0.0033, scheme);
    CHECK(exact_gradient(p).events.size() == 3);
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
  scene += R"LAWS(
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
[spring.s]
from = "Q"
to = "P"
stiffness_N_per_m = 30
natural_length_m = 0.5
[force.wind]
point = "P"
formula_y_N = "b*sin(9*t)"
b = 2
)LAWS";
  scene.replace(scene.find("given = [\"P.y\"]"), 15, "given = [\"P.y\", \"Q.x\"]");
  for (const char* scheme : {"newmark", "generalized-alpha"}) {
    CAPTURE(scheme);
    const Problem p = fixed_problem(scene, arm_numbers({"restitution"}), 0.011, scheme);
    CHECK(exact_gradient(p).events.size() >= 3);
  }
}

// The end of the run is one of the steps' own; its time is a cost, and the level a parameter.
TEST_CASE("fixed cuts: runs that end by an event, by the derivative of the steps", "[free_end][discrete]") {
  const auto swing = [](const std::string& end, const std::string& costs) {
    return free_pendulum("{ " + end + " }", "[[cost.terminal]]\nkind = \"value\"\noutput = \"time\"\n" + costs);
  };
  const std::string costs =
      "[[cost.running]]\nkind = \"square\"\noutput = \"P.y\"\ntarget = { kind = \"sine\", amplitude = 0.6, "
      "angular_frequency_rad_per_s = 7 }\n[[cost.running]]\nkind = \"value\"\noutput = \"rod.tension\"\nweight = "
      "0.1\n[[cost.terminal]]\nkind = \"square\"\noutput = \"P.y_ddot\"\nweight = 0.01\n";
  for (const char* scheme : {"newmark", "generalized-alpha"})
    for (const char* end : {"output = \"P.x\", below = 0.2", "output = \"P.x_dot\", below = -2.0",
                            "output = \"P.y_ddot\", above = 0.5", "output = \"time\", above = 0.777"}) {
      CAPTURE(scheme, end);
      const Problem p = fixed_problem(
          swing(end, costs), {"bar.rod.length_m", "gravity.y_m_per_s2", "angle.swing.angle_rad"}, 0.03, scheme);
      const GradientResult r = exact_gradient(p);
      REQUIRE(r.end);
      CHECK(r.end->t < 3);
    }
  const Problem never = fixed_problem(swing("output = \"P.x\", above = 2.0", ""), {"bar.rod.length_m"}, 0.03);
  CHECK_THROWS_WITH(simulate(never, never.parameters.values()), Contains("never comes"));
}

TEST_CASE("fixed cuts: events and then the run's end, by the derivative of the steps", "[free_end][discrete]") {
  std::string scene = falling_arm(kRigid);
  scene.replace(scene.find("t_end_s = 0.9"), 13, "t_end_s = 2\nends_when = { output = \"P.y\", above = 0.86 }");
  scene += "[[cost.terminal]]\nkind = \"value\"\noutput = \"time\"\n";
  for (const char* scheme : {"newmark", "generalized-alpha"}) {
    CAPTURE(scheme);
    const GradientResult r = exact_gradient(fixed_problem(scene, arm_numbers({"restitution"}), 0.013, scheme));
    CHECK(r.end);
    CHECK(r.events.size() == 1);
  }
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
  // Forces, an actuator's state, weights and targets of costs that are switched. The actuator's derivative is a tenth
  // of psi.
  for (const char* name :
       {"switching_time", "switched_actuator", "switched_product", "switched_weight", "switched_target"})
    for (const char* scheme : {"newmark", "generalized-alpha"}) {
      CAPTURE(name, scheme);
      Problem p = problem_of_case(name);
      p.formulation = "index3";
      p.solver.integrator = "fixed";
      p.solver.step_s = (p.solver.t_end - p.solver.t_start) / 99.0;
      p.formulation_options.set("discrete_scheme", scheme);
      exact_gradient(p, kSums, 5 * kDifferences);
    }
}

// A driver's kink at a time that stands is a cut, too.
TEST_CASE("fixed cuts: kinks of drivers", "[discrete]") {
  const char* law = R"({ kind = "bump", height_m = 0.15, start_m = 0.3, length_m = 0.5, shape = "half_sine" })";
  const Problem p =
      fixed_problem(driven_carriage(law), {"spring.strut.stiffness_N_per_m", "driver.push.law.height_m"}, 0.02);
  const GradientResult r = exact_gradient(p);
  CHECK(r.counters.jumps == 2);
}
