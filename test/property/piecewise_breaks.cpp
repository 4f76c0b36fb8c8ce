// Breaks of piecewise laws as parameters: gradients by them against Richardson differences of whole runs, which use no
// derivative; and what a break may not do.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "property/driven_carriage.h"
#include "property/gradient_compare.h"
#include "property/hessian_compare.h"

using namespace costate;
using Catch::Contains;
using test::driven_carriage;

namespace {

// Some thousand times rtol, which is what an adjoint, or index 2 behind a kink, costs; differences of runs are as
// exact.
constexpr double kRtol = 3e-11, kAllowed = 1e-7;

Problem driven(const std::string& law, const std::vector<std::string>& of_law, const std::string& more = "") {
  std::vector<std::string> names;
  for (const std::string& name : of_law) names.push_back("driver.push.law." + name);
  if (!more.empty()) names.push_back("both");
  Problem problem = make_problem(Scene::parse(driven_carriage(law) + more, "driver.toml"), names);
  problem.solver.rtol = problem.solver.atol = kRtol;
  problem.formulation = "index1";
  return problem;
}

void check(Problem& problem, const std::vector<std::pair<const char*, const char*>>& ways) {
  const auto rho = problem.parameters.values();
  problem.formulation = "index1";
  const GradientResult oracle = gradient(problem, "differences", rho);
  for (const auto& [formulation, method] : ways) {
    INFO(formulation << " " << method);
    problem.formulation = formulation;
    const GradientResult r = gradient(problem, method, rho);
    const auto mismatch = test::gradient_mismatch(r.gradient, oracle.gradient, problem.parameters);
    INFO(mismatch.text);
    CHECK(mismatch.error < kAllowed);
  }
}

const std::vector<std::pair<const char*, const char*>> kCarry = {{"index1", "idas-forward"},
                                                                 {"index1", "cvodes-adjoint"},
                                                                 {"baumgarte", "idas-adjoint"},
                                                                 {"baumgarte", "cvodes-forward"},
                                                                 {"penalty", "cvodes-forward"},
                                                                 {"penalty", "idas-adjoint"},
                                                                 {"penalty-second-order", "cvodes-adjoint"},
                                                                 {"augmented-lagrangian", "cvodes-adjoint"},
                                                                 {"maggi", "cvodes-forward"},
                                                                 {"maggi", "cvodes-adjoint"},
                                                                 {"maggi-implicit", "idas-forward"},
                                                                 {"maggi-implicit", "idas-adjoint"},
                                                                 {"maggi-second-order", "cvodes-adjoint"},
                                                                 {"index2", "idas-forward"},
                                                                 {"index2", "idas-adjoint"},
                                                                 {"index3", "idas-forward"},
                                                                 {"index3", "idas-adjoint"},
                                                                 {"baumgarte", "hand-adjoint"},
                                                                 {"index2", "hand-adjoint"},
                                                                 {"maggi", "hand-tangent"},
                                                                 {"maggi", "discrete-tangent"},
                                                                 {"index1", "discrete-adjoint"}};

using Ways = std::vector<std::pair<const char*, const char*>>;

/// All combinations that exist, but fixed steps, which follow no tolerance.
Ways all_ways() {
  Ways all;
  for (const auto& f : formulations())
    for (const auto& m : sensitivity_methods())
      if (refusal(m, f).empty() && (m.needs != SensitivityMethod::Needs::discrete || f.make_ode))
        all.emplace_back(f.name.c_str(), m.name.c_str());
  return all;
}

// At rest, off with a jerk, slower again: two kinks. A parabola out of rest: a jump of the acceleration, then a kink.
constexpr const char* kCorners =
    R"({ kind = "piecewise", joins = "continued", breaks = [0.3, 0.7], coefficients = [[0.05], [0.6], [-0.2, 0.5]] })";
constexpr const char* kStart =
    R"({ kind = "piecewise", joins = "continued", breaks = [0.25, 0.8], coefficients = [[0], [0, 0.9, -0.3], [0.1]] })";

}  // namespace

TEST_CASE("breaks of a driver's law as parameters: gradients equal differences") {
  SECTION("kinks") {
    Problem problem = driven(kCorners, {"breaks[0]", "breaks[1]", "coefficients[1][0]", "coefficients[2][1]"});
    check(problem, all_ways());
  }
  SECTION("a jump of the acceleration") {
    Problem problem = driven(kStart, {"breaks[0]", "breaks[1]", "coefficients[1][1]"});
    check(problem, kCarry);
  }
  SECTION("inside a sum and scaled") {
    Problem problem =
        driven(fmt::format(R"({{ kind = "sum", terms = [{{ kind = "scaled", slope = 2, nominal_slope = 3, law = {} }},
                           {{ kind = "polynomial", coefficients = [0, 0.1] }}] }})",
                           kCorners),
               {"terms[0].law.breaks[0]", "terms[0].law.breaks[1]", "terms[0].slope"});
    check(problem, kCarry);
  }
  SECTION("bound to coefficients, so that the pieces go on meeting") {
    // 0, then 0.5 (t - b).
    Problem problem = driven(R"({ kind = "piecewise", breaks = [0.3], coefficients = [[0], [-0.15, 0.5]] })", {}, R"(
[parameter.both]
numbers = ["driver.push.law.breaks[0]", "driver.push.law.coefficients[1][0]"]
factors = [1, -0.5]
)");
    check(problem, kCarry);
  }
}

TEST_CASE("breaks of the law of a spring as parameters: every method") {
  const std::string text = driven_carriage("0") + R"(
[spring.stop]
from = "end"
to = "wall"
natural_length_m = 0.8
spring_law = { kind = "piecewise", joins = "continued", breaks = [-0.2, 0.7], coefficients = [[4, 20], [0, 10], [40, 30]] }
)";
  Problem problem = make_problem(Scene::parse(text, "stop.toml"),
                                 {"spring.stop.spring_law.breaks[0]", "spring.stop.spring_law.breaks[1]",
                                  "spring.stop.spring_law.coefficients[2][0]"});
  problem.solver.rtol = problem.solver.atol = kRtol;
  auto ways = kCarry;
  for (const auto& way : {std::pair("index1", "hand-adjoint"), std::pair("index1", "hand-tangent"),
                          std::pair("maggi", "hand-adjoint"), std::pair("index3", "hand-adjoint")})
    ways.push_back(way);
  check(problem, ways);
}

TEST_CASE("breaks as parameters: what they may not do is refused by name") {
  // Pieces of unlike slope that a break parts.
  constexpr const char* kMeet = R"({ kind = "piecewise", breaks = [0.3], coefficients = [[0.1], [-0.05, 0.5]] })";
  Problem problem = driven(kMeet, {"breaks[0]"});
  for (const char* method : {"idas-adjoint", "cvodes-forward"})
    CHECK_THROWS_WITH(
        gradient(problem, method, problem.parameters.values()),
        Contains("Parameter 'driver.push.law.breaks[0]' opens a jump in the law 'driver.push' at t = 0.3") &&
            Contains("joins = \"continued\""));
  // Of like slope, where a kink would open: (t - 0.3)^2.
  problem = driven(R"({ kind = "piecewise", breaks = [0.3], coefficients = [[0.1], [0.19, -0.6, 1]] })", {"breaks[0]"});
  CHECK_THROWS_WITH(gradient(problem, "idas-adjoint", problem.parameters.values()),
                    Contains("opens a kink in the law 'driver.push' at t = 0.3"));
  // The same of a force's law, of which the second is as smooth as it need be.
  const auto pushed = [](const char* coefficients) {
    Problem p = make_problem(Scene::parse(driven_carriage("0") + fmt::format(R"(
[spring.stop]
from = "end"
to = "wall"
natural_length_m = 0.8
spring_law = {{ kind = "piecewise", breaks = [0.5], coefficients = {} }}
)",
                                                                             coefficients),
                                          "stop.toml"),
                             {"spring.stop.spring_law.breaks[0]"});
    p.solver.rtol = p.solver.atol = kRtol;
    return p;
  };
  problem = pushed("[[0], [-20, 40]]");
  CHECK_THROWS_WITH(gradient(problem, "idas-adjoint", problem.parameters.values()),
                    Contains("'spring.stop.spring_law.breaks[0]' opens a jump in the law "
                             "'spring.stop.spring_law' at x = 0.5"));
  problem = pushed("[[0], [10, -40, 40]]");
  const GradientResult r = gradient(problem, "idas-adjoint", problem.parameters.values());
  CHECK(std::abs(r.gradient[0]) < 1e-12);  // moved by little, the law is another one by its square
  test::check_by_differences(driven(kCorners, {"breaks[0]"}), 1e-5, {"index1"});
  // Breaks that change places.
  problem = driven(kCorners, {"breaks[0]"});
  CHECK_THROWS_WITH(simulate(problem, std::vector<double>{0.8}), Contains("'breaks' must increase"));
}

// A half-sine bump, as a driver's law, has a kink at either end: where they lie is start and length.
TEST_CASE("start and length of a half-sine bump as parameters: by every formulation and method") {
  Problem problem = driven(R"({ kind = "bump", height_m = 0.15, start_m = 0.3, length_m = 0.5, shape = "half_sine" })",
                           {"start_m", "length_m", "height_m"});
  check(problem, all_ways());
}
