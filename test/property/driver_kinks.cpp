// Drivers whose laws have kinks: the velocities jump there, by the impulse of the constraints, and gradients
// are carried across; against Richardson differences of whole runs, which use no derivative.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/kind/law/law_table.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/toml_reader.h"
#include "costate/sensitivity/method.h"
#include "property/driven_carriage.h"
#include "property/gradient_compare.h"
#include "support/cases.h"

using namespace costate;
using Catch::Contains;
using Catch::Detail::Approx;
using test::driven_carriage;

namespace {

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
    const Scene read = Scene::parse(driven_carriage(c.law), "driver.toml");
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
    const Scene read = Scene::parse(driven_carriage(c.law), "driver.toml");
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
        driven_carriage(c.law) + "\n[[cost.running]]\nkind = \"square\"\noutput = \"rod.angle_dot\"\n", "driver.toml");
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
  const Scene read = Scene::load(COSTATE_SOURCE_DIR "/test/cases/driven_corner.toml");
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

TEST_CASE("driver with kinks: at the end of the run") {
  for (const char* method : {"idas-adjoint", "idas-forward", "cvodes-adjoint", "cvodes-forward", "discrete-adjoint"}) {
    INFO(method);
    const Problem p = problem_of_case("kink_at_end");
    // By differences of runs that end 1e-4 s before it and behind it.
    const GradientResult r = gradient(p, method, p.parameters.values());
    CHECK(r.psi == Approx(0.6290204).epsilon(1e-6));
    CHECK(r.gradient[0] == Approx(-0.04646767).epsilon(1e-6));
  }
  take_notices();
}

TEST_CASE("driver with kinks: what closed contacts cannot follow is refused by name") {
  for (const char* name : {"kink_pulls", "kink_tips", "kink_slips"})
    for (const char* integrator : {"idas", "cvodes", "radau5", "dopri5"}) {
      INFO(name << " on " << integrator);
      Problem p = problem_of_case(name);
      p.solver.integrator = integrator;
      CHECK_THROWS_WITH(simulate(p, p.parameters.values()),
                        Catch::Contains("the law of a driver has a kink") && Catch::Contains("contact."));
    }
  // It pushes down instead: the driver begins to lift what it carries.
  const Problem p = problem_of_case("kink_pulls", {"distance_driver.d.length_m.coefficients=[[1, 0], [2]]"});
  CHECK(simulate(p, p.parameters.values()).psi == Approx(0).margin(1e-9));
  take_notices();
}

// A driven bar that moves for a while and then rests: on the way back the adjoint is zero until the motion begins, with
// factors that hold nothing of speeds. One iteration with these left out what the length makes of speeds, and the
// gradient was off by 3e-4 to 7 % at any tolerance, in silence. Against forward sensitivities.
TEST_CASE("driver with kinks: the way back over a rest") {
  Problem problem = make_problem(Scene::parse(R"(
[point.G]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = -0.76
y_m = 0.244
[bar.B]
from = "G"
to = "P"
mass_kg = 2.8
length_m = 0.798
[driver.D]
coordinate = "P.y"
law = { kind = "smooth_step", from = 0.337, to = 0.576, before = 0.244, after = 0.287 }
[start]
given = []
[[cost.running]]
kind = "square"
output = "P.x_dot"
[run]
t_end_s = 1
parameters = ["bar.B.length_m"]
)",
                                              "rests.toml"));
  problem.solver.confirm = false;
  for (const double t_end : {0.65, 0.7, 0.757, 0.9, 1.0, 2.0}) {
    problem.solver.t_end = t_end;
    problem.formulation = "index1";
    const double right = gradient(problem, "cvodes-forward", problem.parameters.values()).gradient[0];
    for (const auto& [formulation, method] :
         {std::pair("index1", "idas-adjoint"), std::pair("index2", "idas-adjoint"), std::pair("index3", "idas-adjoint"),
          std::pair("index2", "idas-forward"), std::pair("baumgarte", "idas-adjoint"),
          std::pair("baumgarte", "cvodes-adjoint"), std::pair("maggi-implicit", "idas-adjoint")}) {
      CAPTURE(t_end, formulation, method);
      problem.formulation = formulation;
      // Some thousand times rtol, as above.
      CHECK(gradient(problem, method, problem.parameters.values()).gradient[0] == Approx(right).epsilon(2e-5));
    }
  }
}

namespace {
/// Whether a gradient says that velocities jump then, and that this output is without the impulse.
bool tells_of_impulse(const std::string& scene, const char* time, const char* output) {
  const Problem p = make_problem(Scene::parse(scene, "impulse.toml"));
  take_notices();
  gradient(p, "idas-adjoint", p.parameters.values());
  const std::vector<std::string> said = take_notices();
  return std::any_of(said.begin(), said.end(), [&](const std::string& s) {
    return s.find(time) != std::string::npos && s.find(output) != std::string::npos &&
           s.find("is an impulse") != std::string::npos;
  });
}
}  // namespace

// A mass of 2 kg is driven at 1 m/s, and at 2 m/s from 1 s on: 3 J are an impulse's, in no integral of the power. One
// that is driven over rough ground strikes it at 0.2 s: of 6 J the power has 2.7. A cost of places has no such part.
TEST_CASE("driver with kinks: a cost of the driver's power is told to be without the impulse's work") {
  const std::string kinked = R"([point.P]
x_m = 0
y_m = 0
[mass.m]
point = "P"
mass_kg = 2
[driver.x]
coordinate = "P.x"
law = { kind = "piecewise", breaks = [1.0], coefficients = [[0, 1], [-1, 2]] }
[driver.y]
coordinate = "P.y"
law = 0
[start]
given = []
[run]
t_end_s = 2
parameters = ["mass.m.mass_kg"]
)";
  const std::string striking = R"([gravity]
y_m_per_s2 = -10
[point.P]
x_m = 0
y_m = 0.2
[mass.m]
point = "P"
mass_kg = 2
[driver.x]
coordinate = "P.x"
law = { kind = "polynomial", coefficients = [0, 1.5] }
[contact.f]
kind = "rigid"
point = "P"
restitution = 0.5
closing_speed_m_per_s = 0.3
friction = "coulomb"
friction_coefficient = 0.2
[start]
given = ["P.y"]
[run]
t_end_s = 1
parameters = ["contact.f.friction_coefficient"]
)";
  const std::string power = "[[cost.running]]\nkind = \"value\"\noutput = \"x.power\"\n",
                    place = "[[cost.running]]\nkind = \"value\"\noutput = \"P.x\"\n";
  CHECK(tells_of_impulse(kinked + power, "t = 1 s", "'x.power'"));
  CHECK(tells_of_impulse(striking + power, "t = 0.2 s", "'x.power'"));
  CHECK_FALSE(tells_of_impulse(striking + place, "t = ", "P.x"));
}
