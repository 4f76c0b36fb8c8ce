// Commands that run on all cores: their numbers are those of one.
#include <catch2/catch.hpp>

#include "five_bar.h"
#include "process.h"

using costate::test::costate_json;
using costate::test::kFiveBar;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;

TEST_CASE("check: rows that run beside each other have the numbers that they have one by one, to the bit") {
  const WorkingDirectory here;
  const auto rows = [&](const char* jobs) {
    // Nothing is cut: what a row may take is measured by the clock.
    const Json j = costate_json({"check", kFiveBar, "--t-end", "1", "--rtol", "1e-5", "--no-motions", "--no-files",
                                 "--patience", "1e6", "--jobs", jobs},
                                here.path());
    std::vector<std::string> r;
    for (const Json& row : j.at("rows"))
      r.push_back(row.at("formulation").dump() + row.at("method").dump() + row.at("status").dump() +
                  row.at("psi").dump() + row.at("gradient").dump() + row.at("error").dump());
    return r;
  };
  const auto one = rows("1");
  REQUIRE(one.size() > 40);
  CHECK(rows("4") == one);
}

TEST_CASE("tradeoff, stress, differences: with any number of jobs the numbers are the same, to the bit") {
  const WorkingDirectory here;
  const auto with_jobs = [&](std::vector<std::string> command, const char* jobs) {
    command.insert(command.end(), {"--no-files", "--jobs", jobs});
    return costate_json(command, here.path());
  };
  const auto of_rows = [](const Json& rows, const std::vector<const char*>& keys) {
    std::vector<std::string> r;
    for (const Json& row : rows) {
      r.emplace_back();
      for (const char* key : keys) r.back() += row.value(key, Json()).dump() + " ";
    }
    return r;
  };
  {
    // Nothing is cut: what a run may take is measured by the clock, which counts what a host takes away from its
    // guests. No turns at the clock either.
    const std::vector<std::string> command = {"tradeoff",  kFiveBar,   "--t-end",    "0.5",        "--rtols",
                                              "1e-3,1e-5", "--budget", "0",          "--patience", "1e6",
                                              "--repeats", "0",        "--gradient", "--steps",    "2e-3,1e-3"};
    const Json one = with_jobs(command, "1"), two = with_jobs(command, "2");
    const std::vector<const char*> keys = {"formulation", "integrator", "method", "rtol",  "step_s",
                                           "status",      "psi",        "errors", "drift", "counters"};
    const auto rows = of_rows(one.at("rows"), keys);
    CHECK(rows.size() > 100);
    CHECK(of_rows(two.at("rows"), keys) == rows);
    CHECK(two.at("reference").dump() == one.at("reference").dump());
    CHECK(one.at("runs_beside") == 0);
    CHECK(two.at("runs_beside") == 1);
  }
  {
    const std::vector<std::string> command = {"stress", kFiveBar,        "--axes", "stabilization",
                                              "--set",  "run.t_end_s=1", "--set",  "run.rtol=1e-6"};
    const std::vector<const char*> keys = {"axis", "value", "formulation", "integrator", "verdict", "error", "drift"};
    const auto entries = [&](const char* jobs) {
      return of_rows(with_jobs(command, jobs).at("scenes").at(0).at("entries"), keys);
    };
    const auto one = entries("1");
    CHECK(one.size() > 30);
    CHECK(entries("2") == one);
  }
  {
    const std::vector<std::string> command = {"gradient", kFiveBar, "--t-end", "0.5", "--method", "differences"};
    const Json one = with_jobs(command, "1"), two = with_jobs(command, "2");
    for (const char* key : {"psi", "gradient", "gradient_error", "counters"})
      CHECK(two.at(key).dump() == one.at(key).dump());
  }
}
