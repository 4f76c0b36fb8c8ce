// costate cycle --accuracy: a cycle known as well as it was asked for.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "process.h"
#include "support/paths.h"

using Catch::Contains;
using costate::test::costate_json;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;

TEST_CASE("cycle --accuracy: what is asked for is met") {
  const WorkingDirectory here;
  for (const std::string scene : {"cycles/forced_pendulum.toml", "cycles/rayleigh.toml"}) {
    const std::string file = std::string(COSTATE_SOURCE_DIR "/models/") + scene;
    const Json right = costate_json({"cycle", file, "--no-files", "--rtol", "1e-11"}, here.path());
    for (const std::string asked : {"1e-3", "1e-6"}) {
      CAPTURE(scene, asked);
      const Json run = costate_json({"cycle", file, "--no-files", "--accuracy", asked}, here.path());
      const double a = std::stod(asked);
      CHECK(run["accuracy"]["met"] == true);
      CHECK(run["accuracy"]["estimated"].get<double>() <= a);
      CHECK(run["accuracy"]["rtol"] == run["rtol"]);
      CHECK(!run["accuracy"]["pilots"].empty());
      CHECK(std::abs(run["period_s"].get<double>() - right["period_s"].get<double>()) <=
            a * right["period_s"].get<double>());
      double size = 0, error = 0;
      for (const auto& [name, value] : right["section_coordinates"].items()) {
        size = std::max(size, std::abs(value.get<double>()));
        error = std::max(error, std::abs(run["section_coordinates"][name].get<double>() - value.get<double>()));
      }
      // Each is within the request of the largest of its unit, and so of the largest of all.
      CHECK(error <= a * size);
      // psi's derivatives, too, in the parameters' scales: here these are the parameters.
      size = error = 0;
      for (const auto& [name, value] : right["gradient"].items()) {
        const double scale = std::abs(right["parameters"][name].get<double>());
        size = std::max(size, scale * std::abs(value.get<double>()));
        error = std::max(error, scale * std::abs(run["gradient"][name].get<double>() - value.get<double>()));
      }
      CHECK(size > 0);
      CHECK(error <= a * size);
    }
  }
  const std::string pendulum = COSTATE_SOURCE_DIR "/models/cycles/forced_pendulum.toml";
  const auto refused =
      run_costate({"cycle", pendulum, "--no-files", "--accuracy", "1e-4", "--no-estimate"}, here.path());
  CHECK(refused.status != 0);
  CHECK_THAT(refused.err, Contains("--no-estimate"));
  // That of the scene is told where it is left aside.
  std::string text = costate::test::file_text(pendulum);
  const auto rtol = text.find("rtol");
  REQUIRE(rtol != std::string::npos);
  text.replace(rtol, text.find('\n', rtol) - rtol, "accuracy = 1e-4");
  costate::test::write_text(here.path() / "pendulum.toml", text);
  const auto left = run_costate(
      {"cycle", here.path() / "pendulum.toml", "--no-files", "--no-derivatives", "--no-estimate"}, here.path());
  CHECK(left.status == 0);
  CHECK_THAT(left.err, Contains("The accuracy 0.0001 of [run] is not sought"));
}

TEST_CASE("cycle --accuracy: costs of a cycle, by the cycle and by gradients") {
  const WorkingDirectory here;
  const std::string gait = COSTATE_SOURCE_DIR "/models/walker/gait_stability.toml";
  const Json right = costate_json({"gradient", gait, "--no-files", "--rtol", "1e-10"}, here.path());
  const Json cycle = costate_json({"cycle", gait, "--no-files", "--accuracy", "1e-4", "--no-derivatives"}, here.path());
  CHECK(cycle["accuracy"]["met"] == true);
  const Json run = costate_json({"gradient", gait, "--no-files", "--accuracy", "1e-4"}, here.path());
  CHECK(run["accuracy"]["met"] == true);
  const double psi = right["psi"].get<double>();
  CHECK(std::abs(run["psi"].get<double>() - psi) <= 1e-4 * std::abs(psi));
  double size = 0, error = 0;
  for (const auto& [name, value] : right["gradient"].items()) {
    const double scale = std::max(std::abs(right["parameters"][name].get<double>()), 1e-9);
    size = std::max(size, scale * std::abs(value.get<double>()));
    error = std::max(error, scale * std::abs(run["gradient"][name].get<double>() - value.get<double>()));
  }
  CHECK(error <= 1e-4 * size);
}
