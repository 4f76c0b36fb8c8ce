// Runs that end by an event, from outside: summaries, files, optimization and what is said where the end never comes.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/record/csv_file.h"
#include "process.h"
#include "support/paths.h"

using costate::test::costate_json;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;

namespace {
const std::string kSwing = COSTATE_MODELS_DIR "/shortest_swing/shortest_swing.toml";
}

TEST_CASE("free end: the summary and the trajectory end with the run") {
  const WorkingDirectory here;
  const Json j = costate_json({"simulate", kSwing, "--csv", "--output", "out"}, here.path());
  REQUIRE(j.contains("end"));
  const double t = j.at("end").at("t");
  CHECK(j.at("psi") == t);
  CHECK(j.at("end").at("name") == "'rod.angle' below -1.5708 rad");
  CHECK(std::abs(j.at("terminal").at("rod.angle").get<double>() + std::acos(0.0)) < 1e-12);
  const auto csv = costate::read_csv(here / "out/trajectory.csv");
  CHECK(csv.time_s.back() == t);
  // As many samples as of a run to a fixed end: 500 steps, or one less where the last one falls on the end.
  CHECK(csv.time_s.size() >= 500);
  CHECK(csv.time_s.size() <= 502);
  // The same end where no files are written.
  CHECK(costate_json({"simulate", kSwing, "--no-files"}, here.path()).at("end").at("t") == Approx(t).epsilon(1e-12));
}

// The exact optimum is the radius of gyration, sqrt(1/12) m; psi is flat there, so that a projected gradient of 1e-7
// leaves 1e-7 of the distance.
TEST_CASE("free end: a minimum-time design by the adjoint") {
  const WorkingDirectory here;
  const Json j = costate_json({"optimize", kSwing, "--no-files"}, here.path());
  CHECK(std::abs(j.at("parameters").at("distance").get<double>() - std::sqrt(1.0 / 12)) < 1e-6);
}

TEST_CASE("free end: what never comes is an error that says how near it was") {
  const WorkingDirectory here;
  const auto r =
      costate::test::run_costate({"gradient", kSwing, "--no-files", "--set", "run.ends_when.below=-3.2"}, here.path());
  CHECK(r.status != 0);
  CHECK_THAT(r.err, Catch::Contains("never comes before t_end_s = 5 s") && Catch::Contains("are missing") &&
                        Catch::Contains("apps/README.md#end-never-comes"));
}
