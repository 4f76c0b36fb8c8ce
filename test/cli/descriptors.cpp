// Standard descriptors that are closed, and an error stream that is full.
#include <catch2/catch.hpp>

#include "five_bar.h"
#include "process.h"
#include "support/paths.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::kFiveBar;
using costate::test::Outcome;
using costate::test::Process;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;

namespace {

/// `costate ARGUMENTS` with the shell's redirections.
Outcome shell(const std::string& arguments, const std::string& redirections, const WorkingDirectory& here) {
  std::string line = "'" COSTATE_EXECUTABLE "' ";
  line += arguments;
  line += ' ';
  line += redirections;
  return Process("/bin/sh", {"-c", line}, here.path()).finish();
}

const std::string kOptimize = "optimize '" COSTATE_MODELS_DIR "/five_bar/five_bar.toml' --no-certificate --output out";

}  // namespace

TEST_CASE("closed descriptors are not given to the journal") {
  for (const std::string closed : {"<&-", ">&-", "2>&-", "<&- >&-", "<&- >&- 2>&-"}) {
    INFO(closed);
    const WorkingDirectory here;
    const bool out = closed.find(" >&-") != std::string::npos || closed[0] == '>';
    // What was not printed is a failure where it was asked for; the files are there all the same.
    CHECK(shell(kOptimize, closed, here).status == (out ? 1 : 0));
    CHECK(file_text(here / "out/evaluations.jsonl").rfind("{\"costate_journal\"", 0) == 0);
    CHECK(costate_json({"optimize", kFiveBar, "--no-certificate", "--output", "out", "--resume"}, here.path())
              .at("status") == "ok");
  }
}

TEST_CASE("an error stream that is closed or full does not change the status") {
  const WorkingDirectory here;
  for (const std::string err : {"2>&-", "2>/dev/full"}) {
    INFO(err);
    CHECK(shell("simulate nowhere.toml", err, here).status == 1);
    CHECK(shell("simulate", err, here).status == 2);
    CHECK(shell("frobnicate", err, here).status == 2);
    CHECK(shell(kOptimize, err, here).status == 0);
    CHECK(shell("simulate '" COSTATE_MODELS_DIR "/five_bar/five_bar.toml' --no-files --json", err, here).status == 0);
  }
}

TEST_CASE("an error stream that is full does not keep the other baselines from running") {
  const WorkingDirectory here;
  for (const char* name : {"a.json", "b.json"}) costate::test::write_text(here / name, "{}");
  const Outcome o = shell("regress .", "2>/dev/full", here);
  CHECK(o.status == 1);
  CHECK_THAT(o.out, Contains("2 baselines: 0 moved, 2 failed"));
}

TEST_CASE("a standard output that is full ends in failure, not before the results are written") {
  const WorkingDirectory here;
  const Outcome o = shell(kOptimize, ">/dev/full", here);
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("standard output"));
  CHECK(std::filesystem::exists(here / "out/optimize.json"));
  CHECK(std::filesystem::exists(here / "out/optimized.toml"));
}
