// costate study in parts, as job arrays run them: each run once, killed parts begun again, one table of all.
#include <signal.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>

#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

std::string study(const std::string& options) {
  return "[[design]]\nname = \"d\"\nscene = \"" COSTATE_MODELS_DIR
         "/damped_pendulum/damped_pendulum.toml\"\ntask = \"gradient\"\nkind = \"sobol\"\ncount = 7\noptions = { " +
         options +
         " }\n[design.vary]\n\"spring.strut.stiffness_N_per_m\" = { from = 10, to = 30 }\n"
         "\"spring.strut.damping_N_s_per_m\" = { from = 1, to = 2 }\n";
}

std::size_t lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

TEST_CASE("study: shards run each run once, and merge to the table of the whole") {
  const WorkingDirectory here;
  write_text(here / "s.toml", study("t_end = 0.1"));
  REQUIRE(run_costate({"study", "s.toml", "--output", "whole"}, here.path()).status == 0);
  {
    Process first(COSTATE_EXECUTABLE, {"study", "s.toml", "--output", "parts", "--shard", "1/3", "--quiet"},
                  here.path());
    Process second(COSTATE_EXECUTABLE, {"study", "s.toml", "--output", "parts", "--shard", "2/3", "--quiet"},
                   here.path());
    CHECK(first.finish().status == 0);
    CHECK(second.finish().status == 0);
  }
  CHECK_FALSE(std::filesystem::exists(here / "parts/d.csv"));
  CHECK_FALSE(std::filesystem::exists(here / "parts/study.h5"));
  // Without the third: the table of what there is, the names of what there is not, and status 1.
  const Outcome early = run_costate({"study", "s.toml", "--output", "parts", "--merge"}, here.path());
  CHECK(early.status == 1);
  CHECK_THAT(early.err, Contains("2 of 7 runs are not finished: d.3, d.6"));
  const Json third = costate_json({"study", "s.toml", "--output", "parts", "--shard", "3/3"}, here.path());
  CHECK(third.at("runs").size() == 2);
  const Json merged = costate_json({"study", "s.toml", "--output", "parts", "--merge"}, here.path());
  CHECK(merged.at("status") == "ok");
  std::string whole = file_text(here / "whole/d.csv");
  for (std::size_t at = 0; (at = whole.find(",ok,", at)) != std::string::npos;) whole.replace(at, 4, ",kept,");
  CHECK(file_text(here / "parts/d.csv") == whole);
  CHECK(lines(file_text(here / "parts/d.csv")) == 8);
  CHECK(std::filesystem::exists(here / "parts/study.h5"));
}

TEST_CASE("study: a shard that was killed goes on where it stopped, and is not run twice at once") {
  const WorkingDirectory here;
  write_text(here / "s.toml", study("t_end = 0.1"));
  // Runs that take many seconds each, on a machine without load, too: with 2000 s they were over before they were asked
  // for.
  write_text(here / "long.toml", study("t_end = 50000.0"));
  {
    Process p(COSTATE_EXECUTABLE, {"study", "long.toml", "--output", "out", "--shard", "1/2", "--jobs", "1"},
              here.path());
    REQUIRE(p.wait_until([&] { return std::filesystem::exists(here / "out/d.1/log.txt"); }));
    const Json again = costate_json({"study", "long.toml", "--output", "out", "--shard", "1/2"}, here.path(), 1);
    CHECK_THAT(again.at("error").get<std::string>(), Contains("Shard 1/2 is at work"));
    const Json whole = costate_json({"study", "long.toml", "--output", "out"}, here.path(), 1);
    CHECK_THAT(whole.at("error").get<std::string>(), Contains("Another study is at work"));
    p.send(SIGKILL);
    CHECK(p.finish().signal == SIGKILL);
  }
  for (const char* part : {"1/2", "2/2"})
    REQUIRE(run_costate({"study", "s.toml", "--output", "out", "--shard", part}, here.path()).status == 0);
  CHECK(costate_json({"study", "s.toml", "--output", "out", "--merge"}, here.path()).at("status") == "ok");
  for (const char* wrong : {"0/2", "3/2", "1", "1/2/3", "-1/2", "a/b", "1/0"}) {
    const Outcome o = run_costate({"study", "s.toml", "--shard", wrong}, here.path());
    INFO(wrong);
    CHECK(o.status == 2);
    CHECK_THAT(o.err, Contains("--shard"));
  }
}

TEST_CASE("study: a run that fails in its shard has failed in the whole, with its reason") {
  const WorkingDirectory here;
  const std::string scene =
      "scene = \"" COSTATE_MODELS_DIR "/damped_pendulum/damped_pendulum.toml\"\ntask = \"simulate\"\n";
  write_text(here / "s.toml", "[[run]]\nname = \"good\"\n" + scene + "[[run]]\nname = \"bad\"\n" + scene +
                                  "set = { \"run.ends_when\" = { output = \"P.x\", above = 5.0 } }\n");
  const Json part = costate_json({"study", "s.toml", "--output", "out", "--shard", "1/1"}, here.path(), 1);
  const Json merged = costate_json({"study", "s.toml", "--output", "out", "--merge"}, here.path(), 1);
  CHECK(merged.at("status") == "failed");
  CHECK(merged.at("runs").at(0).at("status") == "kept");
  CHECK(merged.at("runs").at(1).at("status") == "failed");
  CHECK_THAT(merged.at("runs").at(1).at("error").get<std::string>(), Contains("never comes"));
  CHECK(merged.at("runs").at(1).at("error") == part.at("runs").at(1).at("error"));
  // What has failed is run once more where it is asked for again.
  const Json again = costate_json({"study", "s.toml", "--output", "out"}, here.path(), 1);
  CHECK(again.at("runs").at(0).at("status") == "kept");
  CHECK(again.at("runs").at(1).at("status") == "failed");
}

TEST_CASE("study: --set stands over what the study says") {
  const WorkingDirectory here;
  write_text(here / "s.toml", "[[run]]\nname = \"r\"\nscene = \"" COSTATE_MODELS_DIR
                              "/damped_pendulum/damped_pendulum.toml\"\nset = { \"run.t_end_s\" = 0.5 }\n"
                              "options = { max_evaluations = 1 }\n");
  const auto psi = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"study", "s.toml", "--fresh"};
    words.insert(words.end(), more.begin(), more.end());
    return costate_json(words, here.path()).at("runs").at(0).at("psi_before").get<double>();
  };
  const double own = psi({}), longer = psi({"--set", "run.t_end_s=1.0"}), same = psi({"--set", "run.t_end_s=0.5"});
  CHECK(own == same);
  CHECK(own != longer);
  const Outcome o = run_costate({"study", "s.toml", "--set", "run.t_ende=1"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("t_ende"));
}
