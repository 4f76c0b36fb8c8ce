// What a person sees: a progress line on a terminal and only there, one line per evaluation, --quiet and --verbose.
#include <catch2/catch.hpp>
#include <csignal>

#include "five_bar.h"
#include "process.h"

using Catch::Matchers::Contains;
using costate::test::Connection;
using costate::test::kFiveBar;
using costate::test::Outcome;
using costate::test::Process;
using costate::test::run_costate;
using costate::test::WorkingDirectory;

namespace {

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

const std::string kErase = "\x1b[K";

}  // namespace

TEST_CASE("progress: simulated time, percentage, steps and speed, rewritten in place and gone at the end") {
  const WorkingDirectory here;
  const Outcome o = run_costate({"simulate", kFiveBar, "--formulation", "baumgarte", "--t-end", "2000", "--no-confirm"},
                                here.path(), Connection::terminal);
  CHECK(o.status == 0);
  CHECK(count(o.terminal, "\rt = ") >= 2);
  CHECK_THAT(o.terminal, Contains(" of 2000 s") && Contains(" %") && Contains(" steps") && Contains("simulated s/s"));
  // The last progress line is erased before the result is printed.
  const std::size_t last = o.terminal.rfind("\rt = ");
  CHECK_THAT(o.terminal.substr(last), Contains("\r" + kErase + "Five-bar mechanism"));
  CHECK_THAT(o.terminal, Contains("psi = "));
}

TEST_CASE("progress: with results redirected the terminal shows the line and the file has none of it") {
  const WorkingDirectory here;
  const Outcome o = run_costate({"gradient", kFiveBar, "--formulation", "baumgarte", "--t-end", "50"}, here.path(),
                                Connection::terminal_errors);
  CHECK(o.status == 0);
  CHECK_THAT(o.terminal, Contains("\rt = ") && !Contains("psi"));
  CHECK_THAT(o.out, Contains("psi = ") && !Contains("\r") && !Contains(kErase));
}

TEST_CASE("progress: none without a terminal") {
  const WorkingDirectory here;
  for (const std::string command : {"simulate", "gradient", "optimize"})
    for (const std::string option : {"--json", "--quiet", "--verbose", ""}) {
      INFO(command << " " << option);
      std::vector<std::string> arguments = {command, kFiveBar};
      if (!option.empty()) arguments.push_back(option);
      const Outcome o = run_costate(arguments, here.path());
      CHECK(o.status == 0);
      CHECK(o.err.empty());
      CHECK_THAT(o.out, !Contains("\r") && !Contains("\x1b"));
    }
}

TEST_CASE("option --json and --quiet are quiet on a terminal, too") {
  const WorkingDirectory here;
  CHECK(run_costate({"simulate", kFiveBar, "--quiet"}, here.path(), Connection::terminal).terminal.empty());
  CHECK(run_costate({"optimize", kFiveBar, "--quiet"}, here.path(), Connection::terminal).terminal.empty());
  const Outcome o = run_costate({"optimize", kFiveBar, "--json"}, here.path(), Connection::terminal);
  CHECK(costate::test::one_object(o.terminal).at("status") == "ok");
}

TEST_CASE("option --quiet still reports errors") {
  const WorkingDirectory here;
  const Outcome o = run_costate({"simulate", "missing.toml", "--quiet"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("missing.toml"));
}

TEST_CASE("one line per evaluation, as it comes") {
  const WorkingDirectory here;
  const Outcome o = run_costate({"optimize", kFiveBar}, here.path());
  CHECK(count(o.out, "psi = ") == 8);
  CHECK(count(o.out, "projected gradient") == 8);
  CHECK_THAT(o.out, Contains("stopped by stop value") && Contains("results in results/five_bar"));
  // They are there before the run ends.
  Process process(COSTATE_EXECUTABLE, {"optimize", kFiveBar, "--method", "differences", "--max-evaluations", "3"},
                  here.path(), Connection::terminal);
  CHECK(process.wait_until([&] { return count(process.seen(), "projected gradient") >= 2; }));
  const Outcome all = process.finish();
  CHECK(all.status == 0);
  // The progress line is erased before each of them.
  CHECK(count(all.terminal, "\r" + kErase + "     ") >= 2);
}

TEST_CASE("option --verbose adds settings and counters") {
  const WorkingDirectory here;
  for (const std::string command : {"simulate", "gradient", "optimize"}) {
    INFO(command);
    const Outcome plain = run_costate({command, kFiveBar}, here.path());
    const Outcome verbose = run_costate({command, kFiveBar, "--verbose"}, here.path());
    CHECK(verbose.status == 0);
    CHECK_THAT(verbose.out, Contains("counters:") && Contains("settings:") && Contains("sundials 6."));
    CHECK_THAT(plain.out, !Contains("counters:"));
  }
}

TEST_CASE("Ctrl-C typed on the terminal") {
  const WorkingDirectory here;
  Process process(COSTATE_EXECUTABLE, {"simulate", kFiveBar, "--formulation", "baumgarte", "--t-end", "1e4"},
                  here.path(), Connection::terminal);
  REQUIRE(process.wait_until([&] { return count(process.seen(), "simulated s/s") >= 1; }));
  process.type("\x03");
  const Outcome o = process.finish();
  CHECK(o.status == 130);
  CHECK_THAT(o.terminal, Contains("interrupted"));
  CHECK(here.entries().empty());
}

TEST_CASE("option --help and --version") {
  const WorkingDirectory here;
  CHECK_THAT(run_costate({"--version"}, here.path()).out, Contains("0."));
  const Outcome help = run_costate({"--help"}, here.path());
  CHECK(help.status == 0);
  for (const std::string command : {"simulate", "gradient", "optimize", "check", "list", "dump"}) {
    CHECK_THAT(help.out, Contains(command));
    CHECK_THAT(run_costate({command, "--help"}, here.path()).out, Contains("scene"));
  }
  CHECK(run_costate({}, here.path()).status == 2);
}
