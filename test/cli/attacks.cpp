// Files that have no end, are no files, or end while they are read; signals at odd moments; choices that need more
// memory than there is.
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>

#include "five_bar.h"
#include "process.h"
#include "support/paths.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::kFiveBar;
using costate::test::Outcome;
using costate::test::Process;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

TEST_CASE("a pipe among the includes is waited for, and left when told to end") {
  const WorkingDirectory here;
  REQUIRE(::mkfifo((here / "pipe.toml").c_str(), 0600) == 0);
  write_text(here / "scene.toml", "include = [\"pipe.toml\"]\n");
  Process process(COSTATE_EXECUTABLE, {"simulate", "scene.toml", "--no-files"}, here.path());
  int writer = -1;
  REQUIRE(
      process.wait_until([&] { return (writer = ::open((here / "pipe.toml").c_str(), O_WRONLY | O_NONBLOCK)) >= 0; }));
  process.send(SIGTERM);
  CHECK(process.finish().status == 128 + SIGTERM);
  ::close(writer);
}

TEST_CASE("the first Ctrl-C ends what only reads and draws, also while it reads") {
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"sweep", "scene.toml", "--coordinate", "P2.x", "--from", "0", "--to", "1"},
        {"draw", "scene.toml"},
        {"list", "scene.toml"},
        {"dump", "scene.toml"},
        {"modes", "scene.toml"},
        {"equilibrium", "scene.toml"},
        {"gradient", "scene.toml"},
        {"optimize", "scene.toml"}}) {
    INFO(command[0]);
    const WorkingDirectory here;
    REQUIRE(::mkfifo((here / "pipe.toml").c_str(), 0600) == 0);
    write_text(here / "scene.toml", "include = [\"pipe.toml\"]\n");
    Process process(COSTATE_EXECUTABLE, command, here.path());
    int writer = -1;
    REQUIRE(process.wait_until(
        [&] { return (writer = ::open((here / "pipe.toml").c_str(), O_WRONLY | O_NONBLOCK)) >= 0; }));
    process.send(SIGINT);
    CHECK(process.finish().status == 128 + SIGINT);
    ::close(writer);
    CHECK(here.entries() == std::vector<std::string>{"pipe.toml", "scene.toml"});
  }
}

TEST_CASE("no terminal is told what a scene or a command line hides") {
  const WorkingDirectory here;
  const std::string escape = "\x1b[31m", eight_bits = "\xc2\x9b";
  const auto told = [&](const std::vector<std::string>& words) {
    const Outcome o = run_costate(words, here.path());
    INFO(words[0] << ": " << o.out << o.err);
    CHECK(o.out.find('\x1b') == std::string::npos);
    CHECK(o.err.find('\x1b') == std::string::npos);
    CHECK(o.out.find(eight_bits) == std::string::npos);
    CHECK(o.err.find(eight_bits) == std::string::npos);
    return o.out + o.err;
  };
  write_text(here / "scene.toml", "title = \"red \\u001b[31m and \\u009b\"\ninclude = [\"" + kFiveBar + "\"]\n");
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"simulate", "scene.toml", "--no-files"},
        {"gradient", "scene.toml", "--no-files"},
        {"simulate", "scene.toml", "--json", "--no-files"},
        {"optimize", "scene.toml", "--no-files", "--max-evaluations", "2", "--no-certificate"},
        {"check", "scene.toml", "--formulation", "index1"},
        {"compare", "scene.toml", "scene.toml"},
        {"list", "scene.toml"},
        {"dump", "scene.toml"},
        {"modes", "scene.toml"},
        {"equilibrium", "scene.toml"},
        {"sweep", "scene.toml", "--coordinate", "P2.x", "--from", "0.49", "--to", "0.5", "--count", "3"}})
    CHECK_THAT(told(command), Contains("red"));
  told({"draw", "scene.toml"});
  for (const std::string& bad : {escape, eight_bits}) {
    told({"simulate", bad + ".toml"});
    told({bad});
    told({"simulate", kFiveBar, "--no-files", "--set", bad + ".x=1"});
    told({"simulate", kFiveBar, "--no-files", "--formulation", bad});
    told({"simulate", kFiveBar, "--no-files", "--rtol", bad});
    told({"simulate", kFiveBar, "--" + bad});
    told({"regress", bad});
  }
}

TEST_CASE("studies, baselines and journals without an end are refused") {
  const WorkingDirectory here;
  const Outcome study = run_costate({"study", "/dev/zero"}, here.path());
  CHECK(study.status == 1);
  CHECK_THAT(study.err, Contains("/dev/zero") && Contains("which is the limit"));
  REQUIRE(::symlink("/dev/zero", (here / "a.json").c_str()) == 0);
  const Outcome baseline = run_costate({"regress", "a.json"}, here.path());
  CHECK(baseline.status == 1);
  CHECK_THAT(baseline.err, Contains("a.json"));
  for (const bool pipe : {false, true}) {
    const std::string out = pipe ? "pipe" : "zero";
    std::filesystem::create_directory(here / out);
    const auto journal = here / (out + "/evaluations.jsonl");
    REQUIRE((pipe ? ::mkfifo(journal.c_str(), 0600) : ::symlink("/dev/zero", journal.c_str())) == 0);
    for (const bool resume : {false, true}) {
      std::vector<std::string> words = {"optimize", kFiveBar, "--no-certificate", "--output", out};
      if (resume) words.push_back("--resume");
      const Outcome o = run_costate(words, here.path());
      CHECK(o.status == 1);
      CHECK_THAT(o.err, Contains("evaluations.jsonl") && Contains("no regular file"));
    }
  }
}

TEST_CASE("pipes are read to a bound, and as files are below it") {
  const WorkingDirectory here;
  std::string scene = costate::test::file_text(COSTATE_SOURCE_DIR "/test/cases/road_file.toml");
  scene.replace(scene.find("road.txt"), 8, "/dev/stdin");
  write_text(here / "road.toml", scene);
  const auto piped = [&](const std::string& writer, const std::string& words) {
    return Process("/bin/sh", {"-c", writer + " | '" COSTATE_EXECUTABLE "' " + words}, here.path()).finish();
  };
  for (const auto& [writer, words] : {std::pair<std::string, std::string>{"yes '# x'", "simulate /dev/stdin"},

                                      {"yes '1 2'", "simulate road.toml"}}) {
    INFO(words);
    const Outcome o = piped(writer, words + " --no-files");
    CHECK(o.status == 1);
    CHECK_THAT(o.err, Contains("/dev/stdin") && Contains("which is the limit"));
  }
  CHECK(piped("cat '" + kFiveBar + "'", "simulate /dev/stdin --t-end 0.1 --no-files").status == 0);
  CHECK(piped("cat '" COSTATE_SOURCE_DIR "/test/cases/road.txt'", "simulate road.toml --t-end 0.1 --no-files").status ==
        0);
}

TEST_CASE("room for checkpoints that there is not is refused before it is taken") {
  const WorkingDirectory here;
  const Json j =
      costate_json({"gradient", kFiveBar, "--checkpoint-steps", "1000000000000", "--no-files"}, here.path(), 1);
  CHECK_THAT(j.at("error").get<std::string>(), Contains("steps between checkpoints") && Contains("MB"));
}

TEST_CASE("what overflows, and a run between two times with nothing between, is said to") {
  const WorkingDirectory here;
  const auto error = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"simulate", kFiveBar, "--no-files"};
    words.insert(words.end(), more.begin(), more.end());
    return costate_json(words, here.path(), 1).at("error").get<std::string>();
  };
  CHECK_THAT(error({"--set", "gravity.y_m_per_s2=-1e308"}), Contains("overflow") && !Contains("tstop"));
  CHECK_THAT(error({"--set", "run.t_start_s=1e16", "--set", "run.t_end_s=10000000000000002"}),
             Contains("hardly numbers between"));
}
