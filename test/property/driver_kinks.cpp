// Drivers whose laws have kinks: the velocities jump there, by the impulse of the constraints, and gradients
// are carried across; against Richardson differences of whole runs, which use no derivative.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/kind/law/law_table.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/toml_reader.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "property/gradient_compare.h"

using namespace costate;
using Catch::Contains;
using Catch::Detail::Approx;

namespace {

/// A carriage that a law moves along x, and a heavy rod that hangs on it with a damper: the driven velocity
/// jumps at each kink, and with it the rod's rate, by its masses.
std::string scene(const std::string& law) {
  return fmt::format(R"([gravity]
y_m_per_s2 = -9.81

[body.carriage]
x_m = 0
y_m = 0
angle_rad = 0
mass_kg = 2
inertia_kg_m2 = 0.1

[body.rod]
x_m = 0.3
y_m = -0.4
angle_rad = 0.2
mass_kg = 1.5
inertia_kg_m2 = 0.08

[point.eye]
on = "carriage"
x_m = 0
y_m = 0

[point.top]
on = "rod"
x_m = -0.4
y_m = 0.3

[point.end]
on = "rod"
x_m = 0.4
y_m = -0.2

[point.wall]
ground = true
x_m = 1
y_m = 0.5

[revolute.pin]
points = ["eye", "top"]

[driver.level]
coordinate = "carriage.y"
law = 0

[driver.straight]
coordinate = "carriage.angle"
law = 0

[driver.push]
coordinate = "carriage.x"
law = {}

[spring.strut]
from = "end"
to = "wall"
stiffness_N_per_m = 30
natural_length_m = 0.8
damping_N_s_per_m = 2

[start]
given = ["rod.angle"]

[[cost.running]]
kind = "square"
output = "rod.angle"

[[cost.terminal]]
kind = "square"
output = "rod.angle_dot"

[run]
t_end_s = 1.2
rtol = 1e-9
)",
                     law);
}

struct Case {
  const char* name;
  const char* law;
  std::vector<std::string> parameters;  // of the law
  long jumps;
};

const std::vector<std::string> kMechanism = {"spring.strut.stiffness_N_per_m", "body.rod.mass_kg"};

const std::vector<Case>& cases() {
  static const std::vector<Case> all = {
      {"half sine",
       R"({ kind = "bump", height_m = 0.15, start_m = 0.3, length_m = 0.5, shape = "half_sine" })",
       {"driver.push.law.height_m"},
       2},
      // Three that touch: one kink where they do.
      {"half sines that touch",
       R"({ kind = "bump", height_m = 0.1, start_m = 0.1, length_m = 0.3, shape = "half_sine", count = 3, spacing_m = 0.3 })",
       {"driver.push.law.height_m"},
       4},
      {"sweep",
       R"({ kind = "sine_sweep", amplitude_m = 0.08, start_m = 0.35, length_m = 0.6, n_start_1_per_m = 0.8, n_end_1_per_m = 2 })",
       {"driver.push.law.amplitude_m", "driver.push.law.n_start_1_per_m", "driver.push.law.n_end_1_per_m"},
       1},
      {"the sum of two",
       R"({ kind = "sum", terms = [{ kind = "bump", height_m = 0.1, start_m = 0.3, length_m = 0.4, shape = "half_sine" }, { kind = "sine_sweep", amplitude_m = 0.05, start_m = 0.5, length_m = 0.8, n_start_1_per_m = 0.8, n_end_1_per_m = 2 }] })",
       {},
       3}};
  return all;
}

}  // namespace

TEST_CASE("driver with kinks: gradients across them equal differences") {
  for (const Case& c : cases()) {
    INFO(c.name);
    const Scene read = Scene::parse(scene(c.law), "driver.toml");
    std::vector<std::string> parameters = kMechanism;
    parameters.insert(parameters.end(), c.parameters.begin(), c.parameters.end());
    Problem problem = make_problem(read, parameters);
    problem.formulation = "index1";
    const auto rho = problem.parameters.values();
    const GradientResult oracle = gradient(problem, "differences", rho);
    for (const auto& [formulation, method] :
         {std::pair("index1", "idas-forward"), std::pair("index1", "idas-adjoint"),
          std::pair("index1", "cvodes-forward"), std::pair("baumgarte", "idas-adjoint"),
          std::pair("baumgarte", "cvodes-adjoint"), std::pair("penalty", "cvodes-forward"),
          std::pair("penalty", "idas-adjoint"), std::pair("maggi", "cvodes-forward"),
          std::pair("maggi", "cvodes-adjoint"), std::pair("maggi-implicit", "idas-forward"),
          std::pair("maggi-implicit", "idas-adjoint"), std::pair("maggi-second-order", "cvodes-adjoint"),
          std::pair("index2", "idas-forward"), std::pair("index2", "idas-adjoint"),
          std::pair("index3", "idas-adjoint")}) {
      INFO(formulation << " " << method);
      problem.formulation = formulation;
      const GradientResult r = gradient(problem, method, rho);
      // Maggi's changes of coordinates are jumps, too.
      CHECK((formulation[0] == 'm' ? r.counters.jumps >= c.jumps : r.counters.jumps == c.jumps));
      CHECK(r.psi == Approx(oracle.psi).epsilon(1e-6));  // as the gradient, below
      const auto mismatch = test::gradient_mismatch(r.gradient, oracle.gradient, problem.parameters);
      INFO(mismatch.text);
      // A thousand times rtol, which is what an adjoint costs (README); the penalty's own error, 1e-8 with
      // its weight of 1e8 masses, is less.
      CHECK(mismatch.error < 1e-6);
    }
  }
}

TEST_CASE("driver with kinks: hand-derived methods are carried across") {
  for (const Case& c : cases()) {
    INFO(c.name);
    const Scene read = Scene::parse(scene(c.law), "driver.toml");
    std::vector<std::string> parameters = kMechanism;
    parameters.insert(parameters.end(), c.parameters.begin(), c.parameters.end());
    parameters.push_back("point.eye.x_m");  // moves the constraints themselves
    Problem problem = make_problem(read, parameters);
    problem.formulation = "index1";
    const auto rho = problem.parameters.values();
    const GradientResult oracle = gradient(problem, "idas-forward", rho);
    for (const char* formulation : {"index1", "baumgarte", "index2", "index3", "penalty", "penalty-second-order",
                                    "maggi", "maggi-implicit", "maggi-second-order"})
      for (const char* method : {"hand-tangent", "hand-adjoint"}) {
        INFO(formulation << " " << method);
        problem.formulation = formulation;
        const GradientResult r = gradient(problem, method, rho);
        CHECK(r.counters.jumps >= c.jumps);
        const auto mismatch = test::gradient_mismatch(r.gradient, oracle.gradient, problem.parameters);
        INFO(mismatch.text);
        CHECK(mismatch.error < 2e-6);  // as above, for each of the two
      }
  }
}

// Costs on velocities jump with them, and the second-order adjoints hold the rate of their gradient: across a driver's
// kink that is one jump, not one of the velocities and another of a force.
TEST_CASE("driver with kinks: running costs on velocities that jump there") {
  for (const Case& c : cases()) {
    INFO(c.name);
    const Scene read = Scene::parse(
        scene(c.law) + "\n[[cost.running]]\nkind = \"square\"\noutput = \"rod.angle_dot\"\n", "driver.toml");
    std::vector<std::string> parameters = kMechanism;
    parameters.insert(parameters.end(), c.parameters.begin(), c.parameters.end());
    Problem problem = make_problem(read, parameters);
    problem.formulation = "index1";
    const auto rho = problem.parameters.values();
    const GradientResult oracle = gradient(problem, "idas-forward", rho);
    for (const char* formulation : {"index1", "penalty-second-order", "maggi-second-order"}) {
      INFO(formulation);
      problem.formulation = formulation;
      const GradientResult r = gradient(problem, "hand-adjoint", rho);
      const auto mismatch = test::gradient_mismatch(r.gradient, oracle.gradient, problem.parameters);
      INFO(mismatch.text);
      CHECK(mismatch.error < 2e-6);  // as above
    }
  }
}

TEST_CASE("driver with kinks: a linkage's corner of a piecewise law") {
  // psi and its derivative by L were found apart, by relative coordinates.
  const Scene read = Scene::parse(R"([gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.6
y_m = -0.8
[point.Q]
x_m = 1.4
y_m = -1.4
[bar.r1]
from = "A"
to = "P"
mass_kg = 1
length_m = 1
[bar.r2]
from = "P"
to = "Q"
mass_kg = 1
length_m = 1
[angle.a]
bar = "r1"
[driver.m]
coordinate = "a.angle"
law = { kind = "piecewise", breaks = [0.4, 0.9], coefficients = [[-0.9, 0.5], [-1.1, 1.0], [1.6, -2]] }
[start]
given = ["Q.x"]
[[cost.running]]
kind = "square"
output = "Q.x"
[[cost.terminal]]
kind = "value"
output = "Q.y_dot"
[run]
t_end_s = 1.5
)",
                                  "corner.toml");
  Problem problem = make_problem(read, {"bar.r2.length_m", "bar.r2.mass_kg"});
  const auto rho = problem.parameters.values();
  for (const auto& [formulation, method] :
       {std::pair("index1", "idas-adjoint"), std::pair("maggi", "cvodes-adjoint"), std::pair("maggi", "hand-tangent"),
        std::pair("maggi-implicit", "idas-adjoint"), std::pair("maggi-second-order", "hand-adjoint")}) {
    INFO(formulation << " " << method);
    problem.formulation = formulation;
    const GradientResult r = gradient(problem, method, rho);
    CHECK(r.psi == Approx(2.7610379).epsilon(1e-6));
    CHECK(r.gradient[0] == Approx(-1.3145).epsilon(1e-4));
  }
}

TEST_CASE("driver with kinks: what is not carried across is refused by name") {
  const Scene read = Scene::parse(scene(cases()[0].law), "driver.toml");
  Problem problem = make_problem(read, kMechanism);
  const auto rho = problem.parameters.values();
  problem.formulation = "index3";
  problem.solver.integrator = "fixed";
  problem.solver.step_s = 0.01;
  const auto names_it = Contains("A driver's law has a kink at t = 0.3 s");
  CHECK_THROWS_WITH(simulate(problem, rho), names_it && Contains("fixed steps pass it by"));
  CHECK_THROWS_WITH(gradient(problem, "discrete-adjoint", rho), names_it);
  problem.solver.integrator.clear();
  problem.formulation = "index1";
  CHECK_THROWS_WITH(hessian(problem, rho), names_it && Contains("in any formulation"));
}

TEST_CASE("driver with kinks: gradients by their times equal differences") {
  const auto of_law = [](std::vector<std::string> names) {
    for (std::string& name : names) name = "driver.push.law." + name;
    return names;
  };
  // Kinks; several; jumps of the acceleration alone; one of either.
  const std::vector<std::pair<const char*, std::vector<std::string>>> laws = {
      {R"({ kind = "bump", height_m = 0.15, start_m = 0.3, length_m = 0.5, shape = "half_sine" })",
       of_law({"start_m", "length_m", "height_m"})},
      {R"({ kind = "bump", height_m = 0.1, start_m = 0.1, length_m = 0.25, shape = "half_sine", count = 3, spacing_m = 0.3 })",
       of_law({"start_m", "length_m", "spacing_m"})},
      {R"({ kind = "bump", height_m = 0.1, start_m = 0.1, length_m = 0.3, shape = "half_sine", count = 3, spacing_m = 0.3 })",
       of_law({"start_m"})},
      {R"({ kind = "bump", height_m = 0.2, start_m = 0.1, length_m = 0.3 })", of_law({"start_m", "length_m"})},
      {R"({ kind = "sine_sweep", amplitude_m = 0.08, start_m = 0.35, length_m = 0.6, n_start_1_per_m = 0.8, n_end_1_per_m = 2 })",
       of_law({"start_m", "length_m"})},
      {R"({ kind = "sum", terms = [{ kind = "bump", height_m = 0.1, start_m = 0.3, length_m = 0.4, shape = "half_sine" }, { kind = "scaled", slope = 2, nominal_slope = 1, law = { kind = "sine_sweep", amplitude_m = 0.05, start_m = 0.5, length_m = 0.8, n_start_1_per_m = 0.8, n_end_1_per_m = 2 } }] })",
       of_law({"terms[0].start_m", "terms[0].length_m", "terms[1].law.start_m"})}};
  // The second cost jumps at a kink itself, which is a term of its own.
  for (const char* cost : {"rod.angle", "rod.angle_ddot"})
    for (const auto& [law, parameters] : laws) {
      INFO(law << " " << cost);
      std::string text = scene(law);
      text.replace(text.find("output = \"rod.angle\""), 20, fmt::format("output = \"{}\"", cost));
      Problem problem = make_problem(Scene::parse(text, "driver.toml"), parameters);
      problem.formulation = "index1";
      const auto rho = problem.parameters.values();
      const GradientResult oracle = gradient(problem, "differences", rho);
      for (const auto& [formulation, method] :
           {std::pair("index1", "idas-forward"), std::pair("index1", "cvodes-adjoint"),
            std::pair("baumgarte", "idas-adjoint"), std::pair("penalty", "cvodes-forward"),
            std::pair("augmented-lagrangian", "cvodes-adjoint"), std::pair("maggi", "cvodes-forward"),
            std::pair("maggi", "cvodes-adjoint"), std::pair("maggi-implicit", "idas-forward"),
            std::pair("maggi-implicit", "idas-adjoint"), std::pair("index2", "idas-forward"),
            std::pair("index2", "idas-adjoint"), std::pair("index3", "idas-adjoint")}) {
        INFO(formulation << " " << method);
        problem.formulation = formulation;
        const GradientResult r = gradient(problem, method, rho);
        const auto mismatch = test::gradient_mismatch(r.gradient, oracle.gradient, problem.parameters);
        INFO(mismatch.text);
        CHECK(mismatch.error < 1e-6);  // as above
      }
    }
}

TEST_CASE("driver with kinks: where their times cannot move is refused by name") {
  // Methods that do not carry it.
  Problem problem = make_problem(Scene::parse(scene(cases()[0].law), "driver.toml"), {"driver.push.law.start_m"});
  const auto rho = problem.parameters.values();
  problem.formulation = "maggi";
  CHECK_THROWS_WITH(gradient(problem, "hand-adjoint", rho),
                    Contains("Parameter 'driver.push.law.start_m' moves the time t = ") &&
                        Contains("the law of driver 'push' has a kink"));
  // Bumps that touch would part, or overlap; those of a sum as well.
  for (
      const auto& [law, moving] :
      {std::pair(cases()[1].law, "driver.push.law.spacing_m"), std::pair(cases()[1].law, "driver.push.law.length_m"),
       std::pair(
           R"({ kind = "sum", terms = [{ kind = "bump", height_m = 0.1, start_m = 0.1, length_m = 0.3, shape = "half_sine" }, { kind = "bump", height_m = 0.05, start_m = 0.4, length_m = 0.3, shape = "half_sine" }] })",
           "driver.push.law.terms[1].start_m")}) {
    problem = make_problem(Scene::parse(scene(law), "driver.toml"), {moving});
    CHECK_THROWS_WITH(gradient(problem, "idas-adjoint", problem.parameters.values()),
                      Contains("moves the time t = 0.4 s") && Contains("how is not known"));
  }
  // Two elements whose jumps coincide, of which one moves.
  std::string text = scene(cases()[0].law);
  const std::string level = "coordinate = \"carriage.y\"\nlaw = 0";
  text.replace(text.find(level), level.size(), fmt::format("coordinate = \"carriage.y\"\nlaw = {}", cases()[0].law));
  problem = make_problem(Scene::parse(text, "driver.toml"), {"driver.push.law.start_m"});
  CHECK_THROWS_WITH(gradient(problem, "idas-adjoint", problem.parameters.values()),
                    Contains("jumps of 'driver.level' and of 'driver.push' coincide") &&
                        Contains("'driver.push.law.start_m' moves them apart"));
}

TEST_CASE("driver: a parameter that moves a jump of its acceleration is refused by hand-derived methods, in the run") {
  struct Law {
    const char *text, *moving;
    double time;
  };
  for (
      const Law& law :
      {Law{R"({ kind = "bump", height_m = 0.2, start_m = 0.1, length_m = 0.3 })", "start_m", 0.1},
       Law{R"({ kind = "bump", height_m = 0.2, start_m = 0.1, length_m = 0.3 })", "length_m", 0.4},
       Law{R"({ kind = "sine_sweep", amplitude_m = 0.1, n_start_1_per_m = 0.0, n_end_1_per_m = 2.0, start_m = 0.1, length_m = 0.3 })",
           "length_m", 0.4}}) {
    INFO(law.text << " " << law.moving);
    const std::string moving = std::string("driver.push.law.") + law.moving;
    Problem problem = make_problem(Scene::parse(scene(law.text), "driver.toml"), {moving});
    problem.solver.t_end = 0.5;
    const auto rho = problem.parameters.values();
    problem.formulation = "maggi";
    CHECK_THROWS_WITH(gradient(problem, "hand-adjoint", rho),
                      Contains(fmt::format("Parameter '{}' moves the time t = {:g} s", moving, law.time)) &&
                          Contains("has a jump of its second derivative"));
    problem.formulation = "index1";
    CHECK_NOTHROW(gradient(problem, "differences", rho));
    problem.solver.t_end = law.time - 0.01;  // not reached
    CHECK_NOTHROW(gradient(problem, "idas-adjoint", rho));
  }
}

TEST_CASE("laws with kinks say where, at the first place of the next piece") {
  const auto read = [](const std::string& text) {
    static SceneNode root;
    root = read_toml("law = " + text, "law");
    SceneTable table(root);
    return read_law(table, "law");
  };
  const auto kinks = [&](const std::string& text) {
    const LawOptions law = read(text);
    std::vector<double> p, x;
    for (const auto& [key, value] : law.numbers) p.push_back(value);
    law.law->add_kinks(p.data(), x);
    for (const double at : x) {
      INFO(text << " at " << at);
      // The slope just before it is that of the piece before, the slope at it that of the piece behind.
      const auto slope = [&](double place) { return law.law->slope(place, p.data()).d[0]; };
      const double h = 1e-9;
      const double before = slope(at - h), after = slope(at + h);
      CHECK(std::abs(after - before) > 1e-2);
      // Slopes change by less than their curvature, 100, times h on a piece.
      CHECK(slope(std::nextafter(at, -1e9)) == Approx(before).margin(100 * h));
      CHECK(slope(at) == Approx(after).margin(100 * h));
    }
    return x;
  };
  const auto near = [](const std::vector<double>& x, const std::vector<double>& expected) {
    REQUIRE(x.size() == expected.size());
    for (std::size_t i = 0; i < x.size(); ++i) CHECK(x[i] == Approx(expected[i]).epsilon(1e-15).margin(1e-15));
  };
  // Places whose sums are not exact in binary, so that branches and places could disagree by a rounding.
  for (const double start : {0.1, 0.3, -0.7, 0.0, 1e3 + 0.1}) {
    near(kinks(fmt::format(
             R"({{ kind = "bump", height_m = 0.2, start_m = {:.17g}, length_m = 0.7, shape = "half_sine" }})", start)),
         {start, start + 0.7});
    near(
        kinks(fmt::format(
            R"({{ kind = "bump", height_m = 0.2, start_m = {:.17g}, length_m = 0.7, shape = "half_sine", count = 3, spacing_m = 1.1 }})",
            start)),
        {start, start + 0.7, start + 1.1, start + 1.8, start + 2.2, start + 2.9});
    near(
        kinks(fmt::format(
            R"({{ kind = "bump", height_m = 0.2, start_m = {:.17g}, length_m = 0.7, shape = "half_sine", count = 3, spacing_m = 0.7 }})",
            start)),
        {start, start + 0.7, start + 1.4, start + 2.1});
    near(
        kinks(fmt::format(
            R"({{ kind = "sine_sweep", amplitude_m = 0.1, start_m = {:.17g}, length_m = 3, n_start_1_per_m = 0.3, n_end_1_per_m = 2 }})",
            start)),
        {start});
  }
  // No kinks: a cosine's bump, a sweep that begins with waves of no number.
  near(kinks(R"({ kind = "bump", height_m = 0.2, start_m = 0.1, length_m = 0.7 })"), {});
  near(
      kinks(
          R"({ kind = "sine_sweep", amplitude_m = 0.1, start_m = 0.2, length_m = 3, n_start_1_per_m = 0, n_end_1_per_m = 2 })"),
      {});
}
