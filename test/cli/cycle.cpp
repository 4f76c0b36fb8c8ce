// Limit cycles from outside: what is printed, the JSON object, flags, and what is said where there is none.
#include <catch2/catch.hpp>
#include <cmath>

#include "process.h"
#include "support/paths.h"

using costate::test::costate_json;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;
using Catch::Contains;

namespace {
const std::string kRayleigh = COSTATE_MODELS_DIR "/cycles/rayleigh.toml";
const std::string kForced = COSTATE_MODELS_DIR "/cycles/forced_oscillator.toml";
}  // namespace

TEST_CASE("cycle: the summary") {
  const WorkingDirectory here;
  const Json j = costate_json({"cycle", kRayleigh, "--output", "out"}, here.path());
  CHECK(j.at("status") == "ok");
  CHECK(std::abs(j.at("period_s").get<double>() - 6.6632868593231) < 1e-7);
  CHECK(j.at("stable") == true);
  REQUIRE(j.at("multipliers").size() == 1);
  CHECK(std::abs(j.at("multipliers")[0][0].get<double>() - 0.00085969506) < 1e-7);
  CHECK(j.at("multipliers")[0][1] == 0);
  CHECK(j.at("fixed_point").contains("disk.angle"));
  CHECK(j.at("fixed_point").contains("disk.angle_dot"));
  CHECK(j.at("section_errors").at("disk.angle_dot").get<double>() < 1e-7);
  REQUIRE(j.at("events").size() == 1);
  CHECK(j.at("events")[0].at("t") == j.at("period_s"));
  CHECK(j.at("fixed_point_gradient").at("disk.angle_dot").contains("push"));
  CHECK(std::abs(j.at("period_gradient").at("stiffness").get<double>() + 3.69744172839) < 1e-5);
  CHECK(run_costate({"cycle", kRayleigh, "--no-files"}, here.path()).out.find("6.663286") != std::string::npos);
}

TEST_CASE("cycle: flags stand for what the scene does not say") {
  const WorkingDirectory here;
  const Json j =
      costate_json({"cycle", kForced, "--period", "4", "--no-files", "--no-derivatives", "--no-estimate"}, here.path());
  CHECK(j.at("period_s") == 4);
  CHECK(j.at("gradient").is_null());
  CHECK(run_costate({"cycle", kForced, "--no-files", "--relabel", "left"}, here.path()).status != 0);
}

TEST_CASE("cycle: what cannot be found is said by name") {
  const WorkingDirectory here;
  const auto wrong = run_costate({"cycle", kForced, "--no-files", "--period", "1.7"}, here.path());
  CHECK(wrong.status == 1);
  CHECK_THAT(wrong.err, Contains("this is no period of theirs") && Contains("override 'cycle.period_s=1.7'"));
  const auto kept = run_costate(
      {"cycle", kRayleigh, "--no-files", "--set", "torsion_spring.shaft.damper_law.coefficients=[0, 0, 0, 0]"},
      here.path());
  CHECK(kept.status == 1);
  CHECK_THAT(kept.err, Contains("A cycle is not determined") && Contains("apps/README.md#no-cycle"));
  const auto none = run_costate({"cycle", COSTATE_MODELS_DIR "/five_bar/five_bar.toml", "--no-files"}, here.path());
  CHECK(none.status != 0);
  CHECK_THAT(none.err, Contains("has no [cycle]"));
}
