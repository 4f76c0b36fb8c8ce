// costate optimize: it finds the optimum, obeys bounds and constraints, says why it stopped, and what it leaves on disk
// reproduces it.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/record/csv_file.h"
#include "costate/record/hdf5_file.h"
#include "costate/scene/scene.h"
#include "five_bar.h"
#include "process.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::kFiveBar;
using costate::test::kOptimalL01;
using costate::test::kOptimalL02;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

/// The five-bar with the impulse of spring S1 kept at -60 Ns or above. (At rest it would be -97.9 Ns.)
std::string constrained_scene() {
  return file_text(kFiveBar) + R"(
[[optimize.constraint]]
name = "impulse"
upper = 60

[[optimize.constraint.running]]
kind = "value"
output = "S1.force"
weight = -1
)";
}

}  // namespace

TEST_CASE("optimize: the five-bar comes to rest in at most 12 evaluations") {
  for (const std::string method : {"idas-adjoint", "cvodes-adjoint", "idas-forward"}) {
    INFO(method);
    const WorkingDirectory here;
    const Json j = costate_json({"optimize", kFiveBar, "--method", method}, here.path());
    CHECK(j.at("psi").get<double>() < 1e-12);
    CHECK(j.at("evaluations").size() <= 12);
    CHECK(j.at("parameters").at("L01").get<double>() == Approx(kOptimalL01).epsilon(1e-7));
    CHECK(j.at("parameters").at("L02").get<double>() == Approx(kOptimalL02).epsilon(1e-7));
    CHECK_THAT(j.at("stop_reason").get<std::string>(), Contains("stop value"));
    CHECK(j.at("converged") == true);
    CHECK(j.at("bounds_active").empty());
    CHECK(j.at("initial").at("psi").get<double>() == Approx(costate::test::kPsi).epsilon(1e-5));
    for (const Json& e : j.at("evaluations"))
      for (const auto& [name, value] : e.at("parameters").items()) {
        INFO(name);
        CHECK(value.get<double>() >= 1);
        CHECK(value.get<double>() <= 4);
      }
  }
}

TEST_CASE("optimize: a bound in the way is kept and reported") {
  const WorkingDirectory here;
  const Json j = costate_json({"optimize", kFiveBar, "--set", "parameter.L02.lower=1.9"}, here.path());
  CHECK(j.at("parameters").at("L02") == 1.9);
  CHECK(j.at("bounds_active") == Json({"L02"}));
  CHECK(j.at("psi").get<double>() > 1e-6);
  CHECK_THAT(j.at("stop_reason").get<std::string>(), !Contains("stop value"));
  for (const Json& e : j.at("evaluations")) CHECK(e.at("parameters").at("L02").get<double>() >= 1.9);
  // The scene of the optimum has a parameter on its bound, and loads.
  CHECK(costate_json({"simulate", "results/five_bar/optimized.toml", "--no-files"}, here.path())
            .at("parameters")
            .at("L02") == 1.9);
}

TEST_CASE("optimize: what ended it") {
  const WorkingDirectory here;
  const auto reason = [&](const std::vector<std::string>& options) {
    std::vector<std::string> arguments = {"optimize", kFiveBar, "--no-files"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return costate_json(arguments, here.path());
  };
  const Json limit = reason({"--max-evaluations", "3"});
  CHECK(limit.at("evaluations").size() == 3);
  CHECK_THAT(limit.at("stop_reason").get<std::string>(), Contains("limit") && Contains("3 evaluations"));
  CHECK(limit.at("converged") == false);
  // The best of the evaluations is the result, not the last.
  double least = HUGE_VAL;
  for (const Json& e : limit.at("evaluations")) least = std::min(least, e.at("psi").get<double>());
  CHECK(limit.at("psi") == least);
  CHECK(limit.at("evaluations").at(limit.at("best_evaluation").get<std::size_t>() - 1).at("psi") == least);

  CHECK_THAT(reason({"--stop-value", "0.5"}).at("stop_reason").get<std::string>(), Contains("0.5"));
  // The evaluation that meets the gradient's tolerance is the last, and the result.
  const Json flat = reason({"--set", "optimize.gradient_tolerance=0.1", "--stop-value=-1"});
  CHECK_THAT(flat.at("stop_reason").get<std::string>(), Contains("gradient tolerance"));
  for (const Json& e : flat.at("evaluations"))
    CHECK((e.at("projected_gradient").get<double>() <= 0.1) == (e.at("index") == flat.at("evaluations").size()));
  CHECK(flat.at("best_evaluation") == flat.at("evaluations").size());
  CHECK_THAT(
      reason({"--set", "optimize.relative_tolerance=0.9", "--stop-value=-1"}).at("stop_reason").get<std::string>(),
      Contains("relative tolerance"));
}

TEST_CASE("optimize: MMA and SLSQP find the same constrained optimum") {
  const WorkingDirectory here;
  write_text(here / "scene.toml", constrained_scene());
  Json result[2];
  for (const int i : {0, 1}) {
    const std::string algorithm = i == 0 ? "mma" : "slsqp";
    INFO(algorithm);
    const Json j = result[i] = costate_json(
        {"optimize", "scene.toml", "--algorithm", algorithm, "--output", algorithm, "--max-evaluations", "300"},
        here.path());
    CHECK(j.at("algorithm") == algorithm);
    CHECK(j.at("converged") == true);
    // psi_c - upper: satisfied, and active.
    const Json& best = j.at("evaluations").at(j.at("best_evaluation").get<std::size_t>() - 1);
    CHECK(best.at("constraints").at("impulse").get<double>() < 1e-5);
    CHECK(best.at("constraints").at("impulse").get<double>() > -0.1);
    CHECK(j.at("psi").get<double>() < j.at("initial").at("psi").get<double>());
    // Simulated afresh, the optimized scene keeps the constraint: the impulse by the trapezoidal rule of the samples.
    costate_json({"simulate", algorithm + "/optimized.toml", "--output", algorithm}, here.path());
    const auto table = costate::read_hdf5(here / (algorithm + "/trajectory.h5"));
    const auto* force = table.find("outputs", "S1.force");
    REQUIRE(force != nullptr);
    double impulse = 0;
    for (std::size_t k = 1; k < table.time_s.size(); ++k)
      impulse += (table.time_s[k] - table.time_s[k - 1]) * (force->values[k] + force->values[k - 1]) / 2;
    CHECK(impulse > -60.01);
  }
  CHECK(result[0].at("psi").get<double>() == Approx(result[1].at("psi").get<double>()).epsilon(1e-3));
  for (const char* name : {"L01", "L02"})
    CHECK(result[0].at("parameters").at(name).get<double>() ==
          Approx(result[1].at("parameters").at(name).get<double>()).epsilon(1e-3));
}

TEST_CASE("optimize: L-BFGS refuses constraints and names what takes them") {
  const WorkingDirectory here;
  write_text(here / "scene.toml", constrained_scene());
  const Json j = costate_json({"optimize", "scene.toml"}, here.path(), 1);
  CHECK_THAT(j.at("error").get<std::string>(), Contains("mma") && Contains("slsqp") && Contains("scene.toml:"));
  CHECK(here.entries() == std::vector<std::string>{"scene.toml"});
}

TEST_CASE("optimize: the files it leaves") {
  const WorkingDirectory here;
  const Json j = costate_json({"optimize", kFiveBar, "--output", "out"}, here.path());
  CHECK(here.entries() == std::vector<std::string>{"out", "out/after.csv", "out/after.h5", "out/before.csv",
                                                   "out/before.h5", "out/evaluations.jsonl", "out/optimize.json",
                                                   "out/optimized.toml", "out/report.html"});
  // The optimized scene reproduces the optimum.
  const Json again = costate_json({"simulate", "out/optimized.toml", "--no-files"}, here.path());
  CHECK(again.at("parameters") == j.at("parameters"));
  CHECK(again.at("psi").get<double>() < 1e-12);
  CHECK(again.at("psi").get<double>() == Approx(j.at("psi").get<double>()).epsilon(1e-3));

  // Before, point 2 swings; after, it rests.
  const auto before = costate::read_hdf5(here / "out/before.h5"), after = costate::read_hdf5(here / "out/after.h5");
  const auto range = [](const costate::TrajectoryTable& table, const std::string& name) {
    const auto* column = table.find("coordinates", name);
    REQUIRE(column != nullptr);
    const auto [low, high] = std::minmax_element(column->values.begin(), column->values.end());
    return *high - *low;
  };
  CHECK(range(before, "P2.x") > 0.3);
  CHECK(range(after, "P2.x") < 1e-6);
  CHECK(range(after, "P2.y") < 1e-6);
  const auto csv = costate::read_csv(here / "out/after.csv");
  REQUIRE(csv.columns.size() == after.columns.size());
  for (std::size_t i = 0; i < csv.columns.size(); ++i) CHECK(csv.columns[i].values == after.columns[i].values);
}

TEST_CASE("optimize: scales and other units do not change the optimum") {
  const WorkingDirectory here;
  const Json j = costate_json(
      {"optimize", kFiveBar, "--no-files", "--set", "parameter.L01.scale=0.5", "--set", "parameter.L02.scale=20"},
      here.path());
  CHECK(j.at("parameters").at("L01").get<double>() == Approx(kOptimalL01).epsilon(1e-4));
  CHECK(j.at("parameters").at("L02").get<double>() == Approx(kOptimalL02).epsilon(1e-4));
}

TEST_CASE("optimize: one parameter bound to several numbers") {
  // Both natural lengths by one factor; the optimized scene holds the same value for the parameter bit for bit or
  // within rounding, and loads even where the parameter ended on its bound.
  const WorkingDirectory here;
  std::string scene = file_text(kFiveBar);
  scene += R"(
[parameter.both]
numbers = ["spring.S1.damping_N_s_per_m", "spring.S2.damping_N_s_per_m"]
factors = [0.3, 0.7]
lower = 0
upper = 1.1
)";
  const auto insert = [&](const std::string& header) {
    const std::size_t at = scene.find(header);
    REQUIRE(at != std::string::npos);
    scene.insert(at + header.size(),
                 header == "[spring.S1]\n" ? "damping_N_s_per_m = 0.03\n" : "damping_N_s_per_m = 0.07\n");
  };
  insert("[spring.S1]\n");
  insert("[spring.S2]\n");
  write_text(here / "scene.toml", scene);
  const Json j = costate_json({"optimize", "scene.toml", "--parameters", "both", "--output", "out"}, here.path());
  CHECK(j.at("bounds_active") == Json({"both"}));
  CHECK(costate_json({"simulate", "out/optimized.toml", "--parameters", "both", "--no-files"}, here.path())
            .at("parameters")
            .at("both")
            .get<double>() == Approx(1.1));
}

TEST_CASE("optimize: constraints that cannot be kept are told, and nothing has converged") {
  // x = vx <= 10 m and y = vy - 5 <= 15 m at 1 s: x + y >= 32 m is 7 m too much.
  const WorkingDirectory here;
  write_text(here / "far.toml", R"([gravity]
y_m_per_s2 = -10
[point.P]
x_m = 0
y_m = 0
vx_m_per_s = 1
vy_m_per_s = 4
[mass.m]
point = "P"
mass_kg = 1
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "square"
output = "P.x"
[parameter.vx]
number = "point.P.vx_m_per_s"
lower = -10
upper = 10
[parameter.vy]
number = "point.P.vy_m_per_s"
lower = -10
upper = 20
[output.short]
formula = "-P.x - P.y"
unit = "m"
[[optimize.constraint]]
name = "reach"
upper = -32
[[optimize.constraint.terminal]]
kind = "value"
output = "short"
[run]
t_end_s = 1
parameters = ["vx", "vy"]
)");
  const Json j = costate_json({"optimize", "far.toml", "--output", "out"}, here.path());
  CHECK(j.at("converged") == false);
  CHECK_THAT(j.at("notes").dump(), Contains("'reach' is -25, 7 above its bound -32"));
  // Of what can be kept nothing is said.
  const Json near = costate_json(
      {"optimize", "far.toml", "--output", "out", "--set", "optimize.constraint[0].upper=-2"}, here.path());
  CHECK(near.at("notes").empty());
  CHECK(near.at("constraints").at(0).at("psi").get<double>() <= -2 + 1e-6);
}

// It stopped where it began, with "Numbers of one parameter must agree at the start" for each design but the first.
TEST_CASE("optimize: a parameter that is not among the run's does not hold its numbers together") {
  const WorkingDirectory here;
  write_text(here.path() / "tie.toml", R"(
[gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0
[mass.m]
point = "P"
mass_kg = 2
[point.O]
ground = true
x_m = 1
y_m = 0
[spring.s]
from = "O"
to = "P"
stiffness_N_per_m = 20
natural_length_m = 0.5
damping_N_s_per_m = 1
[start]
given = ["P.x", "P.y"]
[parameter.k]
number = "spring.s.stiffness_N_per_m"
[parameter.tie]
numbers = ["spring.s.stiffness_N_per_m", "spring.s.damping_N_s_per_m"]
factors = [20, 1]
[[cost.terminal]]
kind = "square"
output = "P.y"
[run]
t_end_s = 1
parameters = ["k"]
)");
  const Json j = costate_json({"optimize", "tie.toml", "--output", "out"}, here.path());
  CHECK(j.at("status") == "ok");
  CHECK(j.at("psi").get<double>() < 0.1);
  // The scene that is written can be read: without what no longer holds.
  const Json again = costate_json({"gradient", "out/optimized.toml", "--no-files"}, here.path());
  CHECK(again.at("psi").get<double>() == Approx(j.at("psi").get<double>()).epsilon(1e-6));
}
