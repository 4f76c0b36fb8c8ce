// costate compare: two scenes over the same time. What it reports is known in closed form for a falling mass.
#include <catch2/catch.hpp>
#include <cmath>

#include "five_bar.h"
#include "process.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::kFiveBar;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

/// A mass thrown upwards: y = v t - g t^2 / 2 for T = 2 s, and psi = integral of weight y = weight (v T^2/2 - g T^3/6).
const std::string kThrown = R"(title = "Thrown"

[gravity]
y_m_per_s2 = -10

[point.P]
x_m = 0
y_m = 0
vx_m_per_s = 1
vy_m_per_s = 3

[mass.bob]
point = "P"
mass_kg = 2

[start]
given = ["P.x", "P.y"]

[[cost.running]]
kind = "value"
output = "P.y"
weight = 1

[parameter.v]
number = "point.P.vy_m_per_s"

[parameter.g]
number = "gravity.y_m_per_s2"

[run]
t_end_s = 2
parameters = ["v", "g"]
rtol = 1e-10
outputs = ["P.x"]
)";

Json output_named(const Json& j, const std::string& name) {
  for (const Json& o : j.at("outputs"))
    if (o.at("name") == name) return o;
  FAIL("no output " << name);
  return {};
}

}  // namespace

TEST_CASE("compare: a scene with itself") {
  const WorkingDirectory here;
  const Json j = costate_json({"compare", kFiveBar, kFiveBar}, here.path());
  REQUIRE(j.at("outputs").size() == 5);
  CHECK(j.at("outputs").at(0).at("name") == "P2.x");
  for (const Json& o : j.at("outputs")) {
    CHECK(o.at("largest") == 0);
    CHECK(o.at("rms") == 0);
  }
  CHECK(output_named(j, "S1.force").at("unit") == "N");
  CHECK(j.at("psi_difference") == 0);
  CHECK(j.at("gradient_cosine").get<double>() == Approx(1));
  CHECK(j.at("gradient_difference") == Json({{"L01", 0.0}, {"L02", 0.0}}));
  CHECK(j.at("time_ratio").get<double>() > 0);
  for (const char* side : {"a", "b"}) {
    const Json& s = j.at(side);
    CHECK(s.at("psi").get<double>() == Approx(costate::test::kPsi).epsilon(1e-5));
    for (const char* name : {"L01", "L02"})
      CHECK(s.at("gradient").at(name).get<double>() == Approx(costate::test::kGradient.at(name)).epsilon(1e-5));
    CHECK(s.at("coordinates") == 6);
    CHECK(s.at("multipliers") == 4);
    CHECK(s.at("counters").at("steps").get<long>() > 0);
    CHECK(s.at("settings").at("t_end_s") == 5);
  }
  CHECK(Json::parse(file_text(here / "results/five_bar_vs_five_bar/compare.json")) == j);
}

TEST_CASE("compare: differences known in closed form") {
  const WorkingDirectory here;
  write_text(here / "thrown.toml", kThrown);
  // A falls by 8 instead of 10: it is (2/2) t^2 higher. B's y runs from 3^2/20 down to 6 - 20.
  const Json j = costate_json(
      {"compare", "thrown.toml", "thrown.toml", "--set-a", "gravity.y_m_per_s2=-8", "--no-files"}, here.path());
  const Json y = output_named(j, "P.y"), x = output_named(j, "P.x");
  // The integrator's own error is about 1e-9; the samples miss the top by (2e-3 s)^2 * 10 / 8, and the trapezoidal rule
  // has an error of h^2/12 * [d(t^4)/dt] / integral = 2e-6 of the integral, half of it in the root.
  CHECK(y.at("largest").get<double>() == Approx(4).epsilon(1e-7));
  CHECK(y.at("at_s") == 2);
  CHECK(y.at("range").get<double>() == Approx(14.45).margin(1e-5));
  CHECK(y.at("rms").get<double>() == Approx(4 / std::sqrt(5)).epsilon(3e-6));
  CHECK(y.at("largest_relative").get<double>() == Approx(4 / 14.45).epsilon(2e-6));
  CHECK(y.at("rms_relative").get<double>() == Approx(4 / std::sqrt(5) / 14.45).epsilon(4e-6));
  CHECK(x.at("largest").get<double>() < 1e-8);
  CHECK(x.at("range").get<double>() == Approx(2).epsilon(1e-7));
  // psi = 2 v - 4/3 g; its gradient is that of both, 2 and 4/3 (g counts downwards in the scene).
  CHECK(j.at("a").at("psi").get<double>() == Approx(6 - 8 * 4 / 3.).epsilon(1e-7));
  CHECK(j.at("b").at("psi").get<double>() == Approx(6 - 10 * 4 / 3.).epsilon(1e-7));
  CHECK(j.at("psi_difference").get<double>() == Approx(8 / 3.).epsilon(1e-6));
  CHECK(j.at("psi_relative").get<double>() == Approx(8 / 3. / (22 / 3.)).epsilon(1e-6));
  CHECK(j.at("b").at("gradient").at("v").get<double>() == Approx(2).epsilon(1e-6));
  CHECK(j.at("a").at("gradient").at("g").get<double>() == Approx(4 / 3.).epsilon(1e-6));
  CHECK(j.at("gradient_cosine").get<double>() == Approx(1).epsilon(1e-6));
  CHECK_THAT(j.at("notes").dump(), Contains("Parameter g is -8 in A, -10 in B"));
  CHECK(here.entries() == std::vector<std::string>{"thrown.toml"});
}

TEST_CASE("compare: gradients that differ, in B's scaled parameters") {
  const WorkingDirectory here;
  write_text(here / "thrown.toml", kThrown);
  // The weight of A's cost doubles its gradient: the direction is the same and the difference is the whole of B, whose
  // scaled gradient is (3 * 2, 10 * 4/3).
  const Json j = costate_json(
      {"compare", "thrown.toml", "thrown.toml", "--set-a", "cost.running[0].weight=2", "--no-files"}, here.path());
  CHECK(j.at("gradient_cosine").get<double>() == Approx(1).epsilon(1e-9));
  CHECK(j.at("gradient_difference").at("g").get<double>() == Approx(1).epsilon(1e-6));
  CHECK(j.at("gradient_difference").at("v").get<double>() == Approx(6 / (40 / 3.)).epsilon(1e-6));
}

TEST_CASE("compare: two formulations give the same motion") {
  // The same scene by two formulations at rtol 1e-10: apart by their errors only, which grow to some 1e-7 in 5 s.
  const WorkingDirectory here;
  const Json j = costate_json({"compare", kFiveBar, kFiveBar, "--rtol", "1e-10", "--set-a", "run.formulation=baumgarte",
                               "--outputs", "P2.x,P3.y_dot", "--no-gradient", "--no-files"},
                              here.path());
  REQUIRE(j.at("outputs").size() == 2);
  for (const Json& o : j.at("outputs")) {
    CHECK(o.at("largest").get<double>() > 0);
    CHECK(o.at("largest_relative").get<double>() < 1e-5);
    CHECK(o.at("rms").get<double>() <= o.at("largest").get<double>());
  }
  CHECK(j.at("a").at("formulation") == "baumgarte");
  CHECK(j.at("b").at("formulation") == "index1");
  CHECK(j.at("a").at("gradient").is_null());
  CHECK(j.at("gradient_cosine").is_null());
  CHECK(std::abs(j.at("psi_relative").get<double>()) < 1e-6);
}

TEST_CASE("compare: what only one of them has, and times that differ") {
  const WorkingDirectory here;
  write_text(here / "thrown.toml", kThrown);
  std::string other = kThrown;
  other.replace(other.find("[parameter.g]"), 13, "[parameter.h]");
  other.replace(other.find("\"g\"]"), 4, "\"h\"]");
  other.replace(other.find("[\"P.x\"]\n", other.find("outputs")), 8, "[\"P.x\", \"energy.total\"]\n");
  write_text(here / "other.toml", other);
  const Json j =
      costate_json({"compare", "thrown.toml", "other.toml", "--set-b", "run.t_end_s=1", "--no-files"}, here.path());
  CHECK(j.at("t_end_s") == 1);
  CHECK(j.at("a").at("gradient").size() == 1);
  CHECK(j.at("a").at("gradient").at("v").get<double>() == Approx(0.5).epsilon(1e-6));
  const std::string notes = j.at("notes").dump();
  CHECK_THAT(notes, Contains("2 s and 1 s; both were run to 1 s") && Contains("Parameter h exists only in B") &&
                        Contains("Parameter g exists only in A"));
  // An output of constant value has no range to be relative to.
  const Json constant =
      costate_json({"compare", "thrown.toml", "thrown.toml", "--outputs", "P.x_ddot", "--no-files"}, here.path());
  CHECK(constant.at("outputs").at(0).at("largest_relative").is_null());

  const auto text =
      run_costate({"compare", "thrown.toml", "other.toml", "--set-b", "run.t_end_s=1", "--no-files"}, here.path());
  CHECK(text.status == 0);
  CHECK_THAT(text.out, Contains("A: thrown.toml, Thrown") && Contains("P.y [m]") && Contains("coordinates") &&
                           Contains("simulation [s]") && Contains("psi of A is that of B") && Contains("d(psi)/d"));
}

TEST_CASE("compare: a scene without a cost") {
  const WorkingDirectory here;
  std::string scene = kThrown;
  const std::size_t from = scene.find("[[cost.running]]");
  scene.erase(from, scene.find("[parameter.v]") - from);
  write_text(here / "free.toml", scene);
  write_text(here / "thrown.toml", kThrown);
  const Json j = costate_json({"compare", "free.toml", "thrown.toml", "--no-files"}, here.path());
  CHECK(j.at("a").at("psi").is_null());
  CHECK(j.at("psi_difference").is_null());
  CHECK(j.at("gradient_difference").is_null());
  CHECK(j.at("outputs").size() == 2);
}

TEST_CASE("compare: mistakes name the scene or the option") {
  const WorkingDirectory here;
  write_text(here / "thrown.toml", kThrown);
  const auto message = [&](std::vector<std::string> arguments, int status = 1) {
    arguments.insert(arguments.begin(), "compare");
    return costate_json(arguments, here.path(), status).at("error").get<std::string>();
  };
  CHECK_THAT(message({"thrown.toml"}, 2), Contains("other"));
  CHECK_THAT(message({"thrown.toml", "missing.toml"}), Contains("missing.toml"));
  CHECK_THAT(message({"thrown.toml", kFiveBar, "--outputs", "P2.x"}), Contains("'P2.x'") && Contains("'thrown.toml'"));
  CHECK_THAT(message({"thrown.toml", kFiveBar, "--outputs", "P.y"}), Contains("'P.y'") && Contains("five_bar.toml'"));
  CHECK_THAT(message({"thrown.toml", kFiveBar, "--set-b", "run.outputs=['P2.x']"}),
             Contains("nothing to compare") && Contains("--outputs"));
  CHECK_THAT(message({"thrown.toml", "thrown.toml", "--set-b", "run.t_start_s=0.5"}),
             Contains("--set-a run.t_start_s=0.5"));
  CHECK_THAT(message({"thrown.toml", "thrown.toml", "--samples", "0"}), Contains("--samples"));
  CHECK_THAT(message({"thrown.toml", kFiveBar, "--parameters", "L01"}),
             Contains("--parameters") && Contains("thrown.toml"));
  CHECK_THAT(message({"thrown.toml", "thrown.toml", "--formulation", "index9"}),
             Contains("--formulation") && Contains("index9"));
  CHECK(here.entries() == std::vector<std::string>{"thrown.toml"});
}
