// costate check --candidate as a user runs it: right, wrong and misbehaving libraries.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "process.h"
#include "support/paths.h"

namespace {

struct Outcome {
  int status = -1;
  std::string out, err;
  nlohmann::json json() const { return nlohmann::json::parse(out); }
};

std::string read(const std::filesystem::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

Outcome check(const std::string& library, const std::string& spoil, const std::string& options = "--json") {
  const auto directory = std::filesystem::temp_directory_path() / ("costate_candidate_" + std::to_string(getpid()));
  std::filesystem::create_directories(directory);
  const auto out = directory / "out", err = directory / "err";
  const std::string command = "COSTATE_SPOIL=" + spoil + " '" + COSTATE_EXECUTABLE + "' check '" + COSTATE_MODELS_DIR +
                              "/five_bar/five_bar.toml' --t-end 0.5 --no-files --candidate '" + library + "' " +
                              options + " > '" + out.string() + "' 2> '" + err.string() + "'";
  const int status = std::system(command.c_str());
  Outcome o{WIFEXITED(status) ? WEXITSTATUS(status) : -1, read(out), read(err)};
  std::filesystem::remove_all(directory);
  return o;
}

const std::string kLibrary = COSTATE_SPOILED_CANDIDATE;

}  // namespace

TEST_CASE("a right candidate passes") {
  const Outcome o = check(kLibrary, "no");
  INFO(o.out << o.err);
  CHECK(o.status == 0);
  const auto j = o.json();
  CHECK(j["status"] == "ok");
  CHECK(j["formulation"] == "baumgarte");
  CHECK(j["agrees"] == true);
  CHECK(j["findings"].empty());
  CHECK(j["first_disagreement"].is_null());
  CHECK(j["error"] < 1e-6);
}

TEST_CASE("what a candidate prints does not disturb the object") {
  const Outcome o = check(kLibrary, "print");
  CHECK(o.status == 0);
  CHECK(o.json()["status"] == "ok");
}

TEST_CASE("a missing term is named") {
  const Outcome o = check(kLibrary, "term");
  INFO(o.out << o.err);
  CHECK(o.status == 3);
  const auto j = o.json();
  CHECK(j["status"] == "disagreement");
  REQUIRE(j["findings"].size() == 1);
  CHECK(j["findings"][0]["term"] == "(Phi_q^T lambda)_q");
  CHECK(j["findings"][0]["what"] == "missing");
  CHECK(j["findings"][0]["message"] == "(Phi_q^T lambda)_q is missing in the equation of mu_q'");
  CHECK(j["first_disagreement"]["component"].get<std::string>().rfind("mu_", 0) == 0);
  CHECK(check(kLibrary, "term", "").out.find("(Phi_q^T lambda)_q is missing") != std::string::npos);
}

TEST_CASE("a candidate that misbehaves is reported as such") {
  const auto failure = [](const std::string& spoil, const std::string& options = "--json") {
    const Outcome o = check(kLibrary, spoil, options);
    INFO(o.out << o.err);
    CHECK(o.status == 3);
    const auto j = o.json();
    CHECK(j["status"] == "failed");
    return j["failure"].get<std::string>();
  };
  using Catch::Contains;
  // Where sanitizers are built in, the signal is to reach the process all the same.
  const char* before = std::getenv("ASAN_OPTIONS");
  const std::string options = before ? before : "";
  setenv("ASAN_OPTIONS", (options + (options.empty() ? "" : ":") + "handle_segv=0").c_str(), 1);
  CHECK_THAT(failure("crash"), Contains("signal 11") && Contains("rhs()"));
  before ? setenv("ASAN_OPTIONS", options.c_str(), 1) : unsetenv("ASAN_OPTIONS");
  CHECK_THAT(failure("throw"), Contains("no idea"));
  CHECK_THAT(failure("exit"), Contains("ended the process"));
  CHECK_THAT(failure("nan"), Contains("nan"));
  CHECK_THAT(failure("size"), Contains("entries"));
  CHECK_THAT(failure("quadratic"), Contains("not linear"));
  CHECK_THAT(failure("hang", "--json --candidate-limit 5"), Contains("did not end within 5 s"));
}

TEST_CASE("a candidate cannot outlive its limit by closing its descriptors, nor send without end") {
  const auto failure = [](const std::string& spoil, const std::string& limit) {
    const Outcome o = check(kLibrary, spoil, "--json --candidate-limit " + limit);
    INFO(o.out << o.err);
    CHECK(o.status == 3);
    return o.json()["failure"].get<std::string>();
  };
  CHECK_THAT(failure("close", "3"), Catch::Contains("did not end within 3 s"));
  CHECK_THAT(failure("flood", "120"), Catch::Contains("sent more than"));
}

TEST_CASE("an end of the tool ends the candidate and all that it started") {
  using costate::test::file_text;
  using costate::test::Process;
  for (const int signal_number : {SIGINT, SIGTERM, SIGKILL}) {
    INFO("signal " << signal_number);
    const costate::test::WorkingDirectory here;
    const auto pids = here / "pids";
    Process process(
        "/usr/bin/env",
        {"COSTATE_SPOIL=family", "COSTATE_SPOIL_FILE=" + pids.string(), COSTATE_EXECUTABLE, "check",
         COSTATE_MODELS_DIR "/five_bar/five_bar.toml", "--t-end", "0.5", "--no-files", "--candidate", kLibrary},
        here.path());
    REQUIRE(process.wait_until([&] {
      const std::string text = file_text(pids);
      return std::count(text.begin(), text.end(), '\n') == 2;
    }));
    process.send(signal_number);
    const auto o = process.finish();
    if (signal_number == SIGKILL)
      CHECK(o.signal == SIGKILL);
    else
      CHECK(o.status == 128 + signal_number);
    std::istringstream list(file_text(pids));
    for (int pid = 0; list >> pid;) {
      // Its own parent is gone; whoever inherits it may take a moment to bury it.
      const auto lives = [&] {
        std::ifstream status("/proc/" + std::to_string(pid) + "/stat");
        std::string number, name, state;
        return bool(status >> number >> name >> state) && state != "Z";
      };
      for (int i = 0; i < 500 && lives(); ++i) ::usleep(10000);
      CHECK_FALSE(lives());
    }
  }
}

TEST_CASE("what is no candidate is refused") {
  using Catch::Contains;
  CHECK(check("/nowhere/my_adjoint.so", "no").status == 1);
  CHECK_THAT(check("/nowhere/my_adjoint.so", "no").err, Contains("There is no candidate library"));
  CHECK_THAT(check(std::string(COSTATE_MODELS_DIR) + "/five_bar/five_bar.toml", "no").err,
             Contains("cannot be loaded"));
  CHECK_THAT(check(COSTATE_LIBRARY, "no").err, Contains("COSTATE_CANDIDATE"));
  CHECK_THAT(check(kLibrary, "abi").err, Contains("build it again"));
  CHECK_THAT(check(kLibrary, "formulation").err, Contains("lagrange-of-the-third-kind"));
}
