// Runs that end by an event: end times and their gradients, by every formulation and method, and what is refused.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/free_pendulum.h"
#include "support/cases.h"
#include "support/paths.h"

using namespace costate;

namespace {

std::string pendulum(const std::string& ends_when, const std::string& rest) {
  return test::free_pendulum(ends_when, "parameters = [\"L\", \"g\"]\n" + rest);
}

const std::string kTime = R"(
[[cost.terminal]]
kind = "value"
output = "time"
)";
const std::string kBottom = "{ output = \"P.x\", below = 0.0 }";

// Complete elliptic integral of the first kind, by the arithmetic-geometric mean.
double elliptic(double k) {
  double a = 1, b = std::sqrt(1 - k * k);
  for (int i = 0; i < 20; ++i) {
    const double mean = 0.5 * (a + b);
    b = std::sqrt(a * b);
    a = mean;
  }
  return std::acos(-1.0) / (2 * a);
}

struct Row {
  std::string formulation, method;
};

// All combinations that exist; those with fixed steps are in fixed_cuts.cpp.
std::vector<Row> rows() {
  std::vector<Row> all;
  for (const auto& f : formulations())
    for (const auto& m : sensitivity_methods())
      if (refusal(m, f).empty() && (m.needs != SensitivityMethod::Needs::discrete || f.make_ode))
        all.push_back({f.name, m.name});
  return all;
}

}  // namespace

// T = sqrt(L/g) K(sin(theta0/2)), so that dT/dL = T/(2 L) and dT/dg = -T/(2 g). To 1e-9 by all that keep the length of
// the rod exactly; a penalty's rod is longer by O(1/alpha). The hand-derived equations of index 3 are good to 2e-8
// whatever the end (they refine their steps until the gradient changes by less).
TEST_CASE("free end: a pendulum's time to the bottom, against the elliptic integral", "[free_end]") {
  const double L = 1.3, g = 9.81, theta0 = std::acos(-1.0) / 2 - 0.3,
               T = std::sqrt(L / g) * elliptic(std::sin(theta0 / 2));
  Problem p = make_problem(Scene::parse(pendulum(kBottom, kTime), "pendulum.toml"));
  p.solver.rtol = 1e-12;
  p.solver.confirm = false;
  for (const Row& row : rows()) {
    CAPTURE(row.formulation, row.method);
    p.formulation = row.formulation;
    const GradientResult r = gradient(p, row.method, p.parameters.values());
    double exact = find_formulation(row.formulation).exact_constraints() ? 1e-9 : 1e-5;
    if (row.formulation == "index3" && row.method.rfind("hand", 0) == 0) exact = 2e-8;
    CHECK(std::abs(r.psi / T - 1) <= exact);
    CHECK(std::abs(r.gradient[0] / (T / (2 * L)) - 1) <= exact);
    CHECK(std::abs(r.gradient[1] / (-T / (2 * g)) - 1) <= exact);
    REQUIRE(r.end);
    CHECK(std::abs(r.end->t / T - 1) <= exact);
  }
}

// Terminal cost, running cost and the level all move with the end: each method against differences of whole runs by
// another formulation.
TEST_CASE("free end: running and terminal costs get their terms at the end", "[free_end]") {
  const std::string costs = R"(
[[cost.running]]
kind = "square"
output = "P.y"
target = 0.4
weight = 0.7

[[cost.running]]
kind = "value"
output = "P.y_ddot"
weight = 0.01

[[cost.terminal]]
kind = "square"
output = "P.x_dot"
target = { kind = "sine", amplitude = 0.3, angular_frequency_rad_per_s = 2, phase_rad = 0.4 }

[[cost.terminal]]
kind = "value"
output = "time"
weight = 0.5

[parameter.level]
number = "run.ends_when.above"
)";
  const Scene scene = Scene::parse(pendulum("{ output = \"P.y_dot\", above = 0.6 }", costs), "costs.toml");
  Problem p = make_problem(scene, {"L", "g", "level"});
  p.solver.rtol = 1e-11;
  p.solver.confirm = false;
  p.formulation = "maggi";
  const GradientResult d = gradient(p, "differences", p.parameters.values());
  for (const double x : d.gradient) CHECK(std::abs(x) > 0.01);
  for (const Row& row : rows()) {
    if (row.method == "differences") continue;
    CAPTURE(row.formulation, row.method);
    p.formulation = row.formulation;
    const double apart = find_formulation(row.formulation).exact_constraints() ? 1e-7 : 1e-4;
    GradientResult r;
    try {
      r = gradient(p, row.method, p.parameters.values());
    } catch (const CapabilityError& e) {
      // Some hand-derived equations know no costs of accelerations; none refuses the end.
      CHECK(std::string(e.what()).find("ends_when") == std::string::npos);
      continue;
    }
    CHECK(std::abs(r.psi - d.psi) <= apart);
    for (std::size_t j = 0; j < d.gradient.size(); ++j) CHECK(std::abs(r.gradient[j] - d.gradient[j]) <= apart);
  }
}

// The last sample is the end, and psi is that of the motion there.
TEST_CASE("free end: samples end with the run", "[free_end]") {
  Problem p = make_problem(Scene::parse(pendulum(kBottom, kTime), "pendulum.toml"));
  for (const char* formulation : {"index1", "index3", "maggi"}) {
    p.formulation = formulation;
    std::vector<double> times, at, x;
    for (int i = 0; i <= 300; ++i) times.push_back(0.01 * i);
    const Simulation r = simulate(p, p.parameters.values(), times, [&](const MechanismState& s, System&) {
      at.push_back(s.t);
      x.push_back(s.q[0]);
    });
    REQUIRE(at.size() > 10);
    CHECK(at.back() == r.end->t);
    CHECK(r.psi == r.end->t);
    CHECK(std::abs(x.back()) < 1e-12);
    CHECK(at[at.size() - 2] < at.back());
    CHECK(at.back() - at[at.size() - 2] < 0.0100001);
  }
}

// A level that is only just reached within a step: found. A level just out of reach: said, with how near it came.
TEST_CASE("free end: short visits are found, and what never comes is told", "[free_end]") {
  const double left = -1.3 * std::cos(0.3);  // where it swings up to
  for (const double short_of : {1e-3, 1e-6, 1e-8}) {
    CAPTURE(short_of);
    Problem p = make_problem(Scene::parse(
        pendulum(fmt::format("{{ output = \"P.x\", below = {:.17g} }}", left + short_of), kTime), "l.toml"));
    p.solver.rtol = 1e-12;
    CHECK(simulate(p, p.parameters.values()).end);
    p = make_problem(Scene::parse(
        pendulum(fmt::format("{{ output = \"P.x\", below = {:.17g} }}", left - short_of), kTime), "l.toml"));
    p.solver.rtol = 1e-12;
    CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Catch::Contains("'P.x' below -1.24") &&
                                                              Catch::Contains("never comes before t_end_s = 3 s") &&
                                                              Catch::Contains("nearest at t = 1."));
  }
  Problem p = make_problem(Scene::parse(pendulum("{ output = \"P.x\", below = 2.0 }", kTime), "l.toml"));
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Catch::Contains("from the start"));
}

TEST_CASE("free end: grazed ends and what cannot do it are refused by name", "[free_end]") {
  const double left = -1.3 * std::cos(0.3);
  Problem p = make_problem(
      Scene::parse(pendulum(fmt::format("{{ output = \"P.x\", below = {:.17g} }}", left + 1e-15), kTime), "l.toml"));
  p.solver.rtol = 1e-12;
  p.solver.confirm = false;
  take_notices();
  try {
    gradient(p, "cvodes-adjoint", p.parameters.values());
    FAIL("a grazed end has no gradient");
  } catch (const SolverError& e) {
    const std::string text = e.what();  // or, within the tolerance, the level is not met at all
    CHECK((text.find("grazed") != std::string::npos || text.find("never comes") != std::string::npos));
  }
  // Flat, yet there: h' is of the order sqrt(2 h'' 1e-7).
  p = make_problem(
      Scene::parse(pendulum(fmt::format("{{ output = \"P.x\", below = {:.17g} }}", left + 1e-9), kTime), "l.toml"));
  p.solver.rtol = 1e-12;
  p.solver.confirm = false;
  gradient(p, "cvodes-adjoint", p.parameters.values());
  bool told = false;
  for (const auto& s : take_notices()) told = told || s.find("hardly crossed") != std::string::npos;
  CHECK(told);
}

TEST_CASE("free end: mistakes in ends_when have a place", "[free_end]") {
  const auto fails = [](const std::string& ends, const std::string& text) {
    CHECK_THROWS_WITH(Scene::parse(pendulum(ends, kTime), "s.toml"),
                      Catch::StartsWith("s.toml:") && Catch::Contains(text));
  };
  fails("{ output = \"P.q\", above = 1.0 }", "no output 'P.q'");
  fails("{ output = \"P.x\" }", "needs one of 'above' and 'below'");
  fails("{ output = \"P.x\", above = 1.0, below = 0.0 }", "found both");
  fails("{ above = 1.0 }", "output");
  fails("{ output = \"P.x\", above = 1.0, after = 2 }", "after");
  fails("2.0", "ends_when");
}

// Kater's pendulum: about a pin at the distance d of the centre of mass the rod takes sqrt((k^2 + d^2)/(g d)) K(sin 45
// deg) from the horizontal to its lowest place, least at d = k, the radius of gyration.
TEST_CASE("free end: the model of the shortest swing", "[free_end]") {
  const Scene scene = Scene::load(COSTATE_MODELS_DIR "/shortest_swing/shortest_swing.toml");
  const double d = 0.45, g = 9.81, k2 = 1.0 / 12, K = elliptic(std::sqrt(0.5)),
               T = K * std::sqrt((k2 + d * d) / (g * d)), slope = 0.5 * T * (2 * d / (k2 + d * d) - 1 / d);
  Problem p = make_problem(scene);
  const GradientResult r = gradient(p, scene.run.method, p.parameters.values());
  // Some 230 steps, each right to rtol 1e-10 of the rod's swing; tolerances about it scatter by 3e-9.
  CHECK(std::abs(r.psi / T - 1) < 1e-8);
  CHECK(std::abs(r.gradient[0] / slope - 1) < 1e-8);
}

// A ball that bounces down a slope, to a place beyond two touches: psi holds the running cost up to there. By
// differences of maggi's runs, whose own estimates are 1e-7 at most in scaled parameters.
TEST_CASE("free end: behind touches", "[free_end][events]") {
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/bouncing_ball.toml",
                                       {"run.ends_when={ output = 'ball.x', above = 0.6 }"}),
                           {"friction", "radius"});
  p.solver.rtol = 1e-11;
  p.solver.confirm = false;
  p.formulation = "maggi";
  const GradientResult d = gradient(p, "differences", p.parameters.values());
  for (const char* formulation : {"index1", "baumgarte", "augmented-lagrangian", "maggi"})
    for (const char* method : {"cvodes-forward", "cvodes-adjoint", "idas-forward", "idas-adjoint", "hand-tangent",
                               "hand-adjoint", "discrete-tangent", "discrete-adjoint"}) {
      if (!refusal(find_sensitivity_method(method), find_formulation(formulation)).empty()) continue;
      CAPTURE(formulation, method);
      p.formulation = formulation;
      const GradientResult r = gradient(p, method, p.parameters.values());
      CHECK(r.events.size() >= 2);
      for (std::size_t j = 0; j < d.gradient.size(); ++j)
        CHECK(std::abs(r.gradient[j] - d.gradient[j]) * p.parameters.parameters[j].scale <= 1e-7);
    }
}

// With t = sqrt(2 y/g): psi = t - g t, and its derivative (1 - g)/sqrt(2 g y). The impact is behind the end.
TEST_CASE("free end: at the gap that an impact closes it comes before the impact") {
  for (const double y : {2.11, 1.0, 0.37})
    for (const auto& [formulation, method] : {std::pair{"baumgarte", "idas-adjoint"},
                                              {"baumgarte", "idas-forward"},
                                              {"baumgarte", "cvodes-adjoint"},
                                              {"baumgarte", "cvodes-forward"},
                                              {"baumgarte", "discrete-tangent"},
                                              {"baumgarte", "discrete-adjoint"},
                                              {"index1", "idas-adjoint"},
                                              {"penalty", "discrete-adjoint"}}) {
      INFO(formulation << " by " << method << " from " << y << " m");
      Problem p = problem_of_case("end_at_impact", {fmt::format("point.ball.y_m={}", y)});
      p.formulation = formulation;
      const GradientResult r = gradient(p, method, p.parameters.values());
      CHECK(r.psi == Approx((1 - 9.81) * std::sqrt(2 * y / 9.81)).epsilon(1e-6));
      CHECK(r.gradient[0] == Approx((1 - 9.81) / std::sqrt(2 * 9.81 * y)).epsilon(1e-5));
    }
  take_notices();
}

TEST_CASE("free end: a run may end where something touches, but for rounding") {
  for (const char* integrator : {"idas", "cvodes", "radau9", "dopri5"})
    for (const char* kind : {"compliant", "rigid"}) {
      INFO(integrator << ", " << kind);
      Problem p = problem_of_case("end_at_touch", {fmt::format("contact.floor.kind=\"{}\"", kind)});
      p.solver.integrator = integrator;
      double y = NAN;
      simulate(p, {}, {p.solver.t_end}, [&](const MechanismState& s, System&) { y = s.q[1]; });
      CHECK(std::abs(y) < 1e-7);
    }
  take_notices();
}

// An event of the motion that comes with the end lies behind it. By a simulator apart (Dormand and Prince at 1e-12, its
// differences), and of the latch by the level 1e-5 rad before the catch, which moves the derivatives by 2e-5 and 1e-6.
TEST_CASE("free end: where a slide stops or turns, or a latch catches, derivatives are those before it") {
  struct Case {
    const char* scene;
    double first, second, off;
  };
  for (const Case& c : {Case{"until_it_stops", -0.5581571465, 0.2165858643, 1e-6},
                        Case{"until_it_turns", 0.6276365599, -0.1564286153, 1e-5},
                        Case{"until_it_catches", 0.28134229, -0.38836018, 1e-6}})
    for (const std::string method : {"idas-forward", "idas-adjoint", "cvodes-forward", "cvodes-adjoint",
                                     "discrete-tangent", "discrete-adjoint", "hand-tangent", "hand-adjoint"}) {
      INFO(c.scene << " by " << method);
      const Problem p = problem_of_case(c.scene);
      try {
        const GradientResult r = gradient(p, method, p.parameters.values());
        CHECK(r.gradient[0] == Approx(c.first).margin(c.off));
        CHECK(r.gradient[1] == Approx(c.second).margin(c.off));
      } catch (const CapabilityError& e) {
        CHECK_THAT(method, Catch::StartsWith("discrete") || Catch::StartsWith("hand"));
      }
    }
  take_notices();
}

// A bob that falls on a rod from where that lies level pulls with 3 m g h, h below it. With s = sin of the rod's angle
// phi' = sqrt(2 g s), so that the pull grows at 3 m g cos(phi) phi'; the time is a function of h over sqrt(g).
TEST_CASE("free end: by a reaction, and costs on one at the end", "[free_end]") {
  const auto falls = [](const std::string& output, const std::string& ends_when) {
    Problem p = make_problem(Scene::parse(R"(
[gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0
[mass.m]
point = "P"
mass_kg = 1
[distance.d]
from = "O"
to = "P"
[start]
given = ["P.y"]
[[cost.terminal]]
kind = "value"
output = ")" + output + R"("
[run]
t_end_s = 2
)" + ends_when,
                                          "falls.toml"));
    p.solver.rtol = 1e-11;
    p.solver.confirm = false;
    return p;
  };
  const double g = 9.81, level = 15, s = level / (3 * g),
               by_level = 1 / (3 * g * std::sqrt(1 - s * s) * std::sqrt(2 * g * s));
  Problem time = falls("time", R"(ends_when = { output = "d.tension", above = 15 }
parameters = ["run.ends_when.above", "gravity.y_m_per_s2"])"),
          pull = falls("d.tension", R"(ends_when = { output = "P.y", below = -0.5 }
parameters = ["run.ends_when.below", "gravity.y_m_per_s2"])");
  for (const Row& row : rows()) {
    CAPTURE(row.formulation, row.method);
    // A soft rod's tension is off by O(1/alpha), the hand-derived equations of index 3 by what they refine to.
    const bool coarse = !find_formulation(row.formulation).exact_constraints() ||
                        (row.formulation == "index3" && row.method.rfind("hand", 0) == 0);
    const double exact = coarse ? 1e-5 : 1e-7;
    time.formulation = pull.formulation = row.formulation;
    const GradientResult a = gradient(time, row.method, time.parameters.values());
    CHECK(a.gradient[0] == Approx(by_level).epsilon(exact));
    CHECK(a.gradient[1] == Approx(a.psi / (2 * g) + level / g * by_level).epsilon(exact));
    const GradientResult b = gradient(pull, row.method, pull.parameters.values());
    CHECK(b.psi == Approx(1.5 * g).epsilon(exact));
    CHECK(b.gradient[0] == Approx(-3 * g).epsilon(exact));
    CHECK(b.gradient[1] == Approx(-1.5).epsilon(exact));
  }
}

// One link too many leaves open who bears what, not how the platform moves.
TEST_CASE("free end: by an acceleration of a mechanism with redundant rows", "[free_end]") {
  Problem p = make_problem(Scene::load(COSTATE_SOURCE_DIR "/test/cases/ends_by_acceleration.toml"));
  const std::vector<double> rho = p.parameters.values();
  p.solver.rtol = 1e-10;
  p.solver.confirm = false;
  p.formulation = "maggi";
  const GradientResult right = gradient(p, "differences", rho);
  double size = 0;
  for (std::size_t j = 0; j < rho.size(); ++j) size = std::max(size, std::abs(right.gradient[j] * rho[j]));
  for (const auto& [formulation, method] : {std::pair{"maggi", "cvodes-adjoint"},
                                            {"maggi-implicit", "idas-forward"},
                                            {"augmented-lagrangian", "cvodes-forward"},
                                            {"penalty", "idas-adjoint"},
                                            {"penalty", "hand-tangent"}}) {
    p.formulation = formulation;
    const GradientResult r = gradient(p, method, rho);
    CAPTURE(formulation, method);
    for (std::size_t j = 0; j < rho.size(); ++j)  // soft links are off by O(1/alpha)
      CHECK(std::abs((r.gradient[j] - right.gradient[j]) * rho[j]) <= 1e-5 * size);
  }
}
