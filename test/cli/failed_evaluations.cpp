// costate optimize where the motion at some parameters cannot be computed: the step is rejected, the best stays.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "five_bar.h"
#include "process.h"
#include "support/paths.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::one_object;
using costate::test::Outcome;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

const std::string kCases = COSTATE_SOURCE_DIR "/test/cases/";

/// psi of the evaluations that did not fail.
double least_psi(const Json& j) {
  double least = HUGE_VAL;
  for (const Json& e : j.at("evaluations"))
    if (!e.contains("failure")) least = std::min(least, e.at("psi").get<double>());
  return least;
}

/// A four-bar whose coupler, where it is longer than the way from B to D and on, closes no linkage.
std::string edge_scene() {
  return R"(
[point.A]
ground = true
x_m = 0
y_m = 0

[point.B]
x_m = 0.6
y_m = 0.8

[point.D]
ground = true
x_m = 2
y_m = 0

[point.C]
x_m = 1.6
y_m = 0.9

[bar.crank]
from = "A"
to = "B"
length_m = 1
mass_kg = 1

[bar.coupler]
from = "B"
to = "C"
length_m = 1
mass_kg = 1

[bar.rocker]
from = "C"
to = "D"
length_m = 1
mass_kg = 1

[gravity]
y_m_per_s2 = -9.81

[start]
given = ["B.x"]

[[cost.terminal]]
kind = "square"
output = "C.x"
target = 1.15

[parameter.l]
number = "bar.coupler.length_m"
lower = 0.1
upper = 9

[run]
t_end_s = 0.1
parameters = ["l"]
)";
}

}  // namespace

TEST_CASE("optimize: a linkage that locks at some evaluation is a rejected step") {
  const WorkingDirectory here;
  const Json j = costate_json({"optimize", kCases + "failing_evaluation_slsqp.toml", "--algorithm", "slsqp",
                               "--max-evaluations", "12", "--no-certificate", "--output", "out"},
                              here.path());
  CHECK(j.at("status") == "ok");
  CHECK(j.at("failed_evaluations").get<int>() >= 1);
  CHECK(j.at("evaluations").size() <= 12);
  CHECK(j.at("psi") == least_psi(j));
  // Further down than the evaluations before the one that failed.
  double before = HUGE_VAL;
  for (const Json& e : j.at("evaluations")) {
    if (e.contains("failure")) break;
    before = std::min(before, e.at("psi").get<double>());
  }
  CHECK(j.at("psi").get<double>() < before);
  for (const Json& e : j.at("evaluations"))
    if (e.contains("failure")) {
      CHECK(e.at("psi").is_null());
      CHECK(e.at("gradient").is_null());
    }
  CHECK_THAT(file_text(here / "out/report.html"), Contains("Evaluations that failed"));
  CHECK(costate_json({"simulate", "out/optimized.toml", "--no-files"}, here.path()).at("parameters") ==
        j.at("parameters"));
  // It repeats itself from its journal, failures included.
  const Json again = costate_json({"optimize", kCases + "failing_evaluation_slsqp.toml", "--algorithm", "slsqp",
                                   "--max-evaluations", "12", "--no-certificate", "--output", "out", "--resume"},
                                  here.path());
  CHECK(again.at("evaluations") == j.at("evaluations"));
}

TEST_CASE("optimize: a run that needs a hundred times the steps of its neighbours has failed") {
  const WorkingDirectory here;
  // Two times here, so that the test takes seconds. By itself the second evaluation made two million steps.
  // (MMA's second step is a long one whatever psi's unit is.)
  const Json j = costate_json({"optimize", kCases + "failing_evaluation.toml", "--max-evaluations", "3", "--algorithm",
                               "mma", "--no-certificate", "--output", "out", "--step-limit-factor", "2"},
                              here.path());
  CHECK(j.at("evaluations").size() == 3);
  CHECK(j.at("psi") == least_psi(j));
  const Json& counters = j.at("evaluations").at(0).at("counters");
  const long limit =
      std::max(10000L, 2 * std::max(counters.at("steps").get<long>(), counters.at("backward_steps").get<long>()));
  const std::string why = j.at("evaluations").at(1).at("failure");
  // Or sooner, where its pace tells that it will need more.
  const std::string most = std::to_string(limit);
  CHECK_THAT(why, (Contains("after " + most + " steps") || Contains("the limit of " + most + " ")) &&
                      Contains("--step-limit-factor"));
  CHECK(std::filesystem::exists(here / "out/optimized.toml"));
}

TEST_CASE("optimize: every algorithm converges beside a region that cannot be simulated") {
  const WorkingDirectory here;
  write_text(here / "scene.toml", edge_scene());
  for (const std::string algorithm : {"lbfgs", "mma", "slsqp"}) {
    INFO(algorithm);
    const Json j = costate_json({"optimize", "scene.toml", "--algorithm", algorithm, "--output", algorithm,
                                 "--max-evaluations", "60", "--no-certificate"},
                                here.path());
    INFO(j.dump(1));
    CHECK(j.at("psi") == least_psi(j));
    CHECK(j.at("failed_evaluations").get<int>() >= 1);
    CHECK(j.at("converged") == true);
    CHECK(j.at("psi").get<double>() < 1e-12);
  }
}

TEST_CASE(
    "optimize: where the first evaluation fails there is nothing to go back to, and nothing of an earlier run stays") {
  const WorkingDirectory here;
  write_text(here / "scene.toml", edge_scene());
  costate_json({"optimize", "scene.toml", "--output", "out", "--max-evaluations", "2", "--no-certificate"},
               here.path());
  CHECK(std::filesystem::exists(here / "out/optimized.toml"));
  const Json j =
      costate_json({"optimize", "scene.toml", "--output", "out", "--set", "bar.coupler.length_m=8"}, here.path(), 1);
  CHECK_FALSE(j.at("error").get<std::string>().empty());
  CHECK(here.entries() == std::vector<std::string>{"out", "out/evaluations.jsonl", "scene.toml"});
}

TEST_CASE("optimize: without a cost there is nothing to minimise") {
  const WorkingDirectory here;
  std::string scene = edge_scene();
  const std::size_t cost = scene.find("[[cost.terminal]]");
  scene.erase(cost, scene.find("[parameter.l]") - cost);
  write_text(here / "scene.toml", scene);
  const Json j = costate_json({"optimize", "scene.toml"}, here.path(), 1);
  CHECK_THAT(j.at("error").get<std::string>(), Contains("no cost"));
  CHECK(here.entries() == std::vector<std::string>{"scene.toml"});
}

namespace {

/// A mass on a spring, pulled: the softer the spring, the farther the mass gets.
std::string soft_scene(const std::string& parameter) {
  return R"([point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0
[mass.m]
point = "P"
mass_kg = 0.09
[spring.s]
from = "A"
to = "P"
stiffness_N_per_m = 0.2
natural_length_m = 1
[force.f]
point = "P"
x_N = 1
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "value"
output = "P.x"
weight = -1
[run]
t_end_s = 0.5
parameters = ["p"]
[parameter.p]
)" + parameter;
}

}  // namespace

TEST_CASE("failed evaluations: numbers that no scene may have are rejected steps") {
  // psi falls on with a stiffness below zero, which the scene refuses: it was led to -1e3 N/m, and then nothing could
  // be written. A parameter without bounds stays where there is a scene.
  const WorkingDirectory here;
  write_text(here / "soft.toml", soft_scene("number = \"spring.s.stiffness_N_per_m\"\n"));
  const Json j = costate_json({"optimize", "soft.toml", "--output", "out"}, here.path());
  const double k = j.at("parameters").at("p");
  CHECK(k >= 0);
  CHECK(k < 0.2);
  bool told = false;
  for (const Json& e : j.at("evaluations")) {
    CHECK((e.contains("failure") || e.at("parameters").at("p").get<double>() >= 0));
    told = told || (e.contains("failure") &&
                    e.at("failure").get<std::string>().find("must not be negative") != std::string::npos);
  }
  CHECK(told);
  const Json again = costate_json({"gradient", "out/optimized.toml", "--no-files"}, here.path());
  CHECK(again.at("psi").get<double>() == Approx(j.at("psi").get<double>()).epsilon(1e-7));
}

TEST_CASE("failed evaluations: the bound of a parameter with a factor is within its bound") {
  // 3 * 0.1 / 3 is above 0.1 in binary numbers, and optimized.toml was refused for it, at the run's end.
  const WorkingDirectory here;
  write_text(here / "factor.toml", soft_scene(R"(numbers = ["mass.m.mass_kg"]
factors = [3]
lower = 0.01
upper = 0.1
)"));
  // The heavier the slower: psi falls to the upper bound where it counts the other way.
  const Json j =
      costate_json({"optimize", "factor.toml", "--output", "out", "--set", "cost.terminal[0].weight=1"}, here.path());
  CHECK(j.at("parameters").at("p") == 0.1);
  CHECK(j.at("certificate").at("active") == Json({"p.upper"}));
  const Json again = costate_json({"gradient", "out/optimized.toml", "--no-files"}, here.path());
  CHECK(again.at("parameters").at("p") == 0.1);
}
