// Times that parameters move: kinks and jumps of the acceleration of drivers; gradients by them against Richardson
// differences of whole runs, which use no derivative.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/base/error.h"
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
constexpr const char* kHalfSine =
    R"({ kind = "bump", height_m = 0.15, start_m = 0.3, length_m = 0.5, shape = "half_sine" })";
constexpr const char* kTouching =
    R"({ kind = "bump", height_m = 0.1, start_m = 0.1, length_m = 0.3, shape = "half_sine", count = 3, spacing_m = 0.3 })";
}  // namespace

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
      std::string text = driven_carriage(law);
      text.replace(text.find("output = \"rod.angle\""), 20, fmt::format("output = \"{}\"", cost));
      Problem problem = make_problem(Scene::parse(text, "driver.toml"), parameters);
      problem.formulation = "index1";
      const auto rho = problem.parameters.values();
      const GradientResult oracle = gradient(problem, "differences", rho);
      for (const auto& [formulation, method] : {std::pair("index1", "idas-forward"),
                                                std::pair("index1", "cvodes-adjoint"),
                                                std::pair("baumgarte", "idas-adjoint"),
                                                std::pair("penalty", "cvodes-forward"),
                                                std::pair("augmented-lagrangian", "cvodes-adjoint"),
                                                std::pair("maggi", "cvodes-forward"),
                                                std::pair("maggi", "cvodes-adjoint"),
                                                std::pair("maggi-implicit", "idas-forward"),
                                                std::pair("maggi-implicit", "idas-adjoint"),
                                                std::pair("index2", "idas-forward"),
                                                std::pair("index2", "idas-adjoint"),
                                                std::pair("index3", "idas-adjoint"),
                                                std::pair("baumgarte", "hand-tangent"),
                                                std::pair("index1", "hand-adjoint"),
                                                std::pair("index2", "hand-tangent"),
                                                std::pair("index2", "hand-adjoint"),
                                                std::pair("penalty", "hand-adjoint"),
                                                std::pair("maggi", "hand-tangent"),
                                                std::pair("maggi-implicit", "hand-adjoint"),
                                                std::pair("baumgarte", "discrete-tangent"),
                                                std::pair("maggi", "discrete-adjoint")}) {
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
  // Hessians carry that.
  Problem problem = make_problem(Scene::parse(driven_carriage(kHalfSine), "driver.toml"), {"driver.push.law.start_m"});
  const auto rho = problem.parameters.values();
  problem.formulation = "index1";
  test::check_by_differences(problem, 1e-5, {"index1"});
  // Bumps that touch would part, or overlap; those of a sum as well.
  for (
      const auto& [law, moving] :
      {std::pair(kTouching, "driver.push.law.spacing_m"), std::pair(kTouching, "driver.push.law.length_m"),
       std::pair(
           R"({ kind = "sum", terms = [{ kind = "bump", height_m = 0.1, start_m = 0.1, length_m = 0.3, shape = "half_sine" }, { kind = "bump", height_m = 0.05, start_m = 0.4, length_m = 0.3, shape = "half_sine" }] })",
           "driver.push.law.terms[1].start_m")}) {
    problem = make_problem(Scene::parse(driven_carriage(law), "driver.toml"), {moving});
    CHECK_THROWS_WITH(gradient(problem, "idas-adjoint", problem.parameters.values()),
                      Contains("moves the time t = 0.4 s") && Contains("how is not known"));
  }
  // Where the run begins and where it ends.
  std::string early = kHalfSine;
  early.replace(early.find("0.3"), 3, "0");
  problem = make_problem(Scene::parse(driven_carriage(early), "driver.toml"), {"driver.push.law.start_m"});
  CHECK_THROWS_WITH(gradient(problem, "idas-adjoint", problem.parameters.values()),
                    Contains("moves the time t = 0 s") && Contains("the run begins there"));
  problem = make_problem(Scene::parse(driven_carriage(kHalfSine), "driver.toml"), {"driver.push.law.length_m"});
  problem.solver.t_end = 0.8;
  CHECK_THROWS_WITH(gradient(problem, "idas-adjoint", problem.parameters.values()),
                    Contains("moves the time t = 0.8 s") && Contains("the run ends there"));
  // Two elements whose jumps coincide, of which one moves.
  std::string text = driven_carriage(kHalfSine);
  const std::string level = "coordinate = \"carriage.y\"\nlaw = 0";
  text.replace(text.find(level), level.size(), fmt::format("coordinate = \"carriage.y\"\nlaw = {}", kHalfSine));
  problem = make_problem(Scene::parse(text, "driver.toml"), {"driver.push.law.start_m"});
  CHECK_THROWS_WITH(gradient(problem, "idas-adjoint", problem.parameters.values()),
                    Contains("jumps of 'driver.level' and of 'driver.push' coincide") &&
                        Contains("'driver.push.law.start_m' moves them apart"));
}

TEST_CASE("driver: Hessians by a parameter that moves a jump of its acceleration") {
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
    Problem problem = make_problem(Scene::parse(driven_carriage(law.text), "driver.toml"), {moving});
    problem.solver.t_end = 0.5;
    const auto rho = problem.parameters.values();
    problem.formulation = "index1";
    test::check_by_differences(problem, 1e-5, {"index1"});
    problem.solver.t_end = law.time - 0.01;  // not reached
    CHECK_NOTHROW(gradient(problem, "idas-adjoint", rho));
  }
}
