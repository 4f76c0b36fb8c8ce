// Optimizations that loosen their tolerance far from the optimum: the same optimum for less, errors below the progress.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <sstream>

#include "five_bar.h"
#include "process.h"
#include "support/paths.h"

using Catch::Contains;
using namespace costate::test;
using Json = nlohmann::json;

namespace {

using Words = std::vector<std::string>;

const std::string kPendulum = COSTATE_SOURCE_DIR "/models/damped_pendulum/damped_pendulum.toml";

Json optimum(const std::string& scene, std::vector<std::string> options, const WorkingDirectory& here) {
  options.insert(options.begin(), {"optimize", scene, "--no-certificate"});
  return costate_json(options, here.path());
}

long callbacks(const Json& run) {
  long n = 0;
  for (const Json& e : run["evaluations"])
    for (const char* key : {"residuals", "backward_residuals"}) n += e["counters"].value(key, 0L);
  return n;
}

}  // namespace

TEST_CASE("adaptation: the same optimum for less", "[adaptation]") {
  const WorkingDirectory here;
  const Json fixed = optimum(kPendulum, {"--rtol", "1e-10", "--no-files"}, here);
  const Json run = optimum(kPendulum, {"--rtol", "1e-10", "--adapt-accuracy", "--output", "out"}, here);
  // psi is flat at the optimum: what is left is rtol's own error, usually below 200 rtol.
  CHECK(std::abs(run["psi"].get<double>() - fixed["psi"].get<double>()) <= 2e-8 * fixed["psi"].get<double>());
  // Seen: 0.38.
  CHECK(callbacks(run) < 0.45 * static_cast<double>(callbacks(fixed)));
  const Json& evaluations = run["evaluations"];
  const Json& best = evaluations.at(run["best_evaluation"].get<std::size_t>() - 1);
  CHECK(best["rtol"] == 1e-10);
  double before = 1;
  // A point at two tolerances: the looser one's error is below what was gained by going there.
  std::map<std::string, double> psi;
  double least = evaluations.at(0)["psi"], last_gain = 0;
  for (const Json& e : evaluations) {
    const double rtol = e["rtol"], now = e["psi"];
    CAPTURE(e["index"], rtol);
    CHECK(rtol <= before);
    before = rtol;
    const std::string point = e["parameters"].dump();
    if (psi.contains(point)) {
      if (last_gain > 0) CHECK(std::abs(psi[point] - now) <= last_gain);
      least = now;
    } else if (now < least) {
      last_gain = least - now;
      least = now;
    }
    psi[point] = now;
  }
  const Json& a = run["adaptation"];
  CHECK(a["tolerances"].size() >= 2);
  CHECK(a["tolerances"].back()["rtol"] == 1e-10);
  int all = 0;
  for (const Json& t : a["tolerances"]) all += t["evaluations"].get<int>();
  CHECK(all == static_cast<int>(evaluations.size()));
  CHECK(a["again"].get<int>() + static_cast<int>(psi.size()) == all);
  CHECK_THAT(file_text(here / "out/report.html"), Contains("the last tolerance throughout"));
  // An interrupted run goes on bit by bit.
  std::string journal = file_text(here / "out/evaluations.jsonl");
  std::size_t line = 0;
  for (int i = 0; i < 6; ++i) line = journal.find('\n', line) + 1;
  write_text(here / "out/evaluations.jsonl", journal.substr(0, line));
  const Json resumed = optimum(kPendulum, {"--rtol", "1e-10", "--adapt-accuracy", "--output", "out", "--resume"}, here);
  CHECK(resumed["psi"] == run["psi"]);
  CHECK(resumed["evaluations"].size() == evaluations.size());
  // What is said of the start is of its tightest evaluation.
  const double start = run["initial"]["rtol"];
  for (const Json& e : evaluations)
    if (e["parameters"] == run["initial"]["parameters"]) CHECK(e["rtol"] >= start);
}

TEST_CASE("adaptation: a run that a limit has ended goes on, and one that ends earlier leaves the journal",
          "[adaptation]") {
  const WorkingDirectory here;
  const Words how = {"--rtol", "1e-9", "--adapt-accuracy", "--output", "out"};
  const Json whole = optimum(kFiveBar, how, here);
  const std::string journal = file_text(here / "out/evaluations.jsonl");
  const auto with = [&](const Words& more) {
    Words all = how;
    all.insert(all.end(), more.begin(), more.end());
    return optimum(kFiveBar, all, here);
  };
  // Its last evaluation, of the best point at the last tolerance, the longer run does not ask for.
  const Json limited = with({"--max-evaluations", "4"});
  CHECK(limited["evaluations"].back()["rtol"] == 1e-9);
  const Json resumed = with({"--resume"});
  CHECK(resumed["psi"] == whole["psi"]);
  CHECK(resumed["evaluations"].size() == whole["evaluations"].size());
  const std::string after = file_text(here / "out/evaluations.jsonl");
  const Json shorter = with({"--resume", "--max-evaluations", "4"});
  CHECK(shorter["psi"] == limited["psi"]);
  CHECK(file_text(here / "out/evaluations.jsonl") == after);
}

TEST_CASE("adaptation: what --accuracy chose is told to whoever resumes, and resumes", "[adaptation]") {
  const WorkingDirectory here;
  const Json whole = optimum(kFiveBar, {"--accuracy", "1e-4", "--output", "out"}, here);
  const Outcome refused =
      run_costate({"optimize", kFiveBar, "--accuracy", "1e-4", "--output", "out", "--resume"}, here.path());
  CHECK(refused.status == 1);
  const std::size_t from = refused.err.find("--formulation"), to = refused.err.find(" in its place");
  REQUIRE(to != std::string::npos);
  Words options = {"--output", "out", "--resume"};
  std::istringstream words(refused.err.substr(from, to - from));
  for (std::string w; words >> w;) options.push_back(w);
  CHECK(optimum(kFiveBar, options, here)["psi"] == whole["psi"]);
}

TEST_CASE("adaptation: with a stop value, with --accuracy, and where it cannot be", "[adaptation]") {
  const WorkingDirectory here;
  const Json stopped = optimum(kFiveBar, {"--rtol", "1e-9", "--adapt-accuracy", "--no-files"}, here);
  CHECK(stopped["psi"].get<double>() <= 1e-13);  // the scene's stop value
  CHECK(stopped["evaluations"].back()["rtol"] == 1e-9);
  const Json accurate = optimum(kPendulum, {"--accuracy", "1e-7", "--no-files"}, here);
  CHECK(accurate.contains("adaptation"));
  CHECK(accurate["converged"] == true);
  const auto refused = run_costate({"optimize", kPendulum, "--no-files", "--adapt-accuracy", "--formulation", "index3",
                                    "--method", "discrete-adjoint"},
                                   here.path());
  CHECK(refused.status != 0);
  CHECK_THAT(refused.err, Contains("--adapt-accuracy") && Contains("Fixed steps"));
}
