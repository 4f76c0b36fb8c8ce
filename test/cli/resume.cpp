// An optimization that was killed goes on with --resume as if nothing had happened: its table of evaluations equals
// that of an undisturbed run, wall-clock times apart.
#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>

#include "five_bar.h"
#include "process.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::kFiveBar;
using costate::test::Outcome;
using costate::test::Process;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

using Words = std::vector<std::string>;

/// Slow enough to be killed in the middle: some hundredths of a second an evaluation.
const Words kRun = {"optimize", kFiveBar, "--rtol", "1e-12", "--output", "out"};

Words with(Words arguments, const Words& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

/// The evaluations without what a clock decides.
Json table(const Json& result) {
  Json rows = result.at("evaluations");
  for (Json& row : rows) row.erase("wall_s");
  return rows;
}

/// What a resumed run must agree in with an undisturbed one.
void check_same(const Json& resumed, const Json& undisturbed) {
  CHECK(table(resumed) == table(undisturbed));
  for (const char* key : {"psi", "parameters", "gradient", "stop_reason", "initial", "best_evaluation", "converged"})
    CHECK(resumed.at(key) == undisturbed.at(key));
}

const Json& undisturbed() {
  static const Json result = [] {
    const WorkingDirectory here;
    return costate_json(kRun, here.path());
  }();
  return result;
}

long lines_of(const std::filesystem::path& path) {
  const std::string text = file_text(path);
  return std::count(text.begin(), text.end(), '\n');
}

}  // namespace

TEST_CASE("resume: killed by SIGKILL after some evaluations") {
  const auto total = static_cast<long>(undisturbed().at("evaluations").size());
  for (const long evaluations : {0L, 1L, 3L, total - 2}) {
    INFO("after " << evaluations << " evaluations");
    const WorkingDirectory here;
    const auto journal = here / "out/evaluations.jsonl";
    {
      Process process(COSTATE_EXECUTABLE, kRun, here.path());
      REQUIRE(process.wait_until([&] { return lines_of(journal) >= 1 + evaluations; }));
      process.send(SIGKILL);
      REQUIRE(process.finish().signal == SIGKILL);
    }
    CHECK(lines_of(journal) < 1 + total);
    // Nothing but the journal: results are written whole, at the end.
    CHECK(here.entries() == Words{"out", "out/evaluations.jsonl"});
    check_same(costate_json(with(kRun, {"--resume"}), here.path()), undisturbed());
    CHECK(lines_of(journal) == 1 + total);
  }
}

TEST_CASE("resume: killed again and again") {
  const WorkingDirectory here;
  const auto journal = here / "out/evaluations.jsonl";
  for (long evaluations = 2; evaluations <= 4; ++evaluations) {
    Process process(COSTATE_EXECUTABLE, with(kRun, {"--resume"}), here.path());
    REQUIRE(process.wait_until([&] { return lines_of(journal) >= 1 + evaluations; }));
    process.send(SIGKILL);
    REQUIRE(process.finish().signal == SIGKILL);
  }
  check_same(costate_json(with(kRun, {"--resume"}), here.path()), undisturbed());
}

TEST_CASE("resume: from a journal that ends anywhere, also in the middle of a line") {
  const WorkingDirectory whole;
  costate_json(kRun, whole.path());
  const std::string journal = file_text(whole / "out/evaluations.jsonl");
  std::vector<std::size_t> cuts;
  for (std::size_t at = journal.find('\n'); at != std::string::npos; at = journal.find('\n', at + 1)) {
    cuts.push_back(at + 1);                                 // after a line
    if (at + 2 < journal.size()) cuts.push_back(at + 2);    // after the first byte of the next
    if (at + 90 < journal.size()) cuts.push_back(at + 90);  // in the middle of a number
    if (cuts.size() > 3) cuts.push_back(at);                // just before a line break
  }
  for (const std::size_t cut : cuts) {
    INFO("cut at byte " << cut << " of " << journal.size());
    const WorkingDirectory here;
    std::filesystem::create_directory(here / "out");
    write_text(here / "out/evaluations.jsonl", journal.substr(0, cut));
    check_same(costate_json(with(kRun, {"--resume"}), here.path()), undisturbed());
    CHECK(lines_of(here / "out/evaluations.jsonl") == lines_of(whole / "out/evaluations.jsonl"));
  }
}

TEST_CASE("resume: a finished run is repeated from its journal without computing") {
  const WorkingDirectory here;
  costate_json(kRun, here.path());
  const std::string journal = file_text(here / "out/evaluations.jsonl");
  std::filesystem::remove(here / "out/optimized.toml");
  const Json again = costate_json(with(kRun, {"--resume"}), here.path());
  check_same(again, undisturbed());
  CHECK(file_text(here / "out/evaluations.jsonl") == journal);
  CHECK(std::filesystem::exists(here / "out/optimized.toml"));
}

TEST_CASE("resume: without a journal it is a new run") {
  const WorkingDirectory here;
  check_same(costate_json(with(kRun, {"--resume"}), here.path()), undisturbed());
}

TEST_CASE("resume: the limit of evaluations may be raised") {
  const WorkingDirectory here;
  const Json limited = costate_json(with(kRun, {"--max-evaluations", "3"}), here.path());
  REQUIRE(limited.at("evaluations").size() == 3);
  check_same(costate_json(with(kRun, {"--resume"}), here.path()), undisturbed());
}

TEST_CASE("resume: other settings are refused, named, and the journal is kept") {
  const WorkingDirectory here;
  costate_json(with(kRun, {"--max-evaluations", "2"}), here.path());
  const std::string journal = file_text(here / "out/evaluations.jsonl");
  const auto refused = [&](const Words& options, const std::string& named) {
    const Json j = costate_json(with({"optimize", kFiveBar, "--output", "out", "--resume"}, options), here.path(), 1);
    CHECK_THAT(j.at("error").get<std::string>(), Contains("cannot resume") && Contains(named));
    CHECK(file_text(here / "out/evaluations.jsonl") == journal);
  };
  refused({"--rtol", "1e-11"}, "rtol");
  refused({"--rtol", "1e-12", "--method", "idas-forward"}, "method");
  refused({"--rtol", "1e-12", "--formulation", "baumgarte"}, "formulation");
  refused({"--rtol", "1e-12", "--parameters", "L01"}, "parameters");
  refused({"--rtol", "1e-12", "--t-end", "4"}, "t_end_s");
  refused({"--rtol", "1e-12", "--stop-value", "1e-3"}, "stop_value");
  refused({"--rtol", "1e-12", "--set", "spring.S1.stiffness_N_per_m=101"}, "scene");
}

TEST_CASE("resume: a damaged journal is refused with the line") {
  const WorkingDirectory here;
  costate_json(with(kRun, {"--max-evaluations", "3"}), here.path());
  const std::string journal = file_text(here / "out/evaluations.jsonl");
  const std::size_t second = journal.find('\n') + 1, third = journal.find('\n', second) + 1;
  const auto refused = [&](const std::string& text, const std::string& named) {
    write_text(here / "out/evaluations.jsonl", text);
    const Json j = costate_json(with(kRun, {"--resume"}), here.path(), 1);
    CHECK_THAT(j.at("error").get<std::string>(), Contains("journal") && Contains(named));
    CHECK(file_text(here / "out/evaluations.jsonl") == text);
  };
  refused(journal.substr(0, second) + "{\"index\": oops}\n" + journal.substr(third), "line 2");
  refused(journal.substr(0, second) + "{\"index\": 1}\n" + journal.substr(third), "Record 1");
  // Two evaluations swapped: no longer what this run asks for.
  refused(journal.substr(0, second) + journal.substr(third), "Evaluation 1");
}

TEST_CASE("interrupted by Ctrl-C or SIGTERM: says so, and can be resumed") {
  for (const int signal_number : {SIGINT, SIGTERM}) {
    INFO("signal " << signal_number);
    const WorkingDirectory here;
    const auto journal = here / "out/evaluations.jsonl";
    Process process(COSTATE_EXECUTABLE, with(kRun, {"--json"}), here.path());
    REQUIRE(process.wait_until([&] { return lines_of(journal) >= 3; }));
    process.send(signal_number);
    const Outcome o = process.finish();
    CHECK(o.status == 128 + signal_number);
    CHECK_THAT(o.err, Contains("interrupted"));
    const Json j = costate::test::one_object(o.out);
    CHECK(j.at("status") == "interrupted");
    CHECK(here.entries() == Words{"out", "out/evaluations.jsonl"});
    check_same(costate_json(with(kRun, {"--resume"}), here.path()), undisturbed());
  }
}

TEST_CASE("interrupted: every command stops soon and leaves nothing") {
  for (const Words& command : {Words{"simulate", "--t-end", "1e5"}, Words{"gradient", "--method", "cvodes-forward", "--t-end", "1e5"},
                               Words{"gradient", "--method", "differences", "--t-end", "1000"},
                               Words{"check", "--rtol", "1e-12", "--t-end", "1000"}}) {
    INFO(command[0]);
    const WorkingDirectory here;
    Process process(COSTATE_EXECUTABLE, with(command, {kFiveBar, "--output", "out"}), here.path(),
                    costate::test::Connection::terminal_errors);
    REQUIRE(process.wait_until([&] { return process.seen().find(" steps") != std::string::npos; }));
    process.send(SIGINT);
    const Outcome o = process.finish();
    CHECK(o.status == 130);
    CHECK(o.out.empty());
    CHECK_THAT(o.terminal, Contains("interrupted"));
    CHECK(here.entries().empty());
  }
}
