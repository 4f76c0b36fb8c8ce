// An optimization that was killed goes on with --resume as if nothing had happened: its table of evaluations equals
// that of an undisturbed run, wall-clock times apart.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <filesystem>

#include "costate/record/journal.h"
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

TEST_CASE("resume: what is damaged in a journal is cut off with a message, and never half believed") {
  const WorkingDirectory here;
  costate_json(with(kRun, {"--max-evaluations", "4"}), here.path());
  const auto path = here / "out/evaluations.jsonl";
  const std::string journal = file_text(path);
  const std::size_t second = journal.find('\n') + 1, third = journal.find('\n', second) + 1;
  const auto goes_on = [&](const std::string& text, std::size_t kept, const std::string& why) {
    INFO(why);
    write_text(path, text);
    Words words = with(kRun, {"--resume", "--json"});
    const Outcome o = costate::test::run_costate(words, here.path());
    CHECK(o.status == 0);
    CHECK_THAT(o.err, Contains("record " + std::to_string(kept + 1) + " is damaged") && Contains(why) &&
                          Contains("after evaluation " + std::to_string(kept)));
    const Json j = costate::test::one_object(o.out);
    check_same(j, undisturbed());
    CHECK_THAT(j.at("notes").dump(), Contains("damaged"));
  };
  goes_on(journal.substr(0, second) + "{\"index\": oops}\n" + journal.substr(third), 0, "syntax error");
  goes_on(journal.substr(0, second) + "{\"index\": 1}\n" + journal.substr(third), 0, "no checksum");
  // Evaluations that are right, but not in their place.
  goes_on(journal.substr(0, second) + journal.substr(third), 0, "checksum");
  // A sign that flipped, and a digit.
  const std::size_t psi = journal.find("\"psi\":", third) + 6;
  goes_on(journal.substr(0, psi) + "-" + journal.substr(psi), 1, "checksum");
  std::string digit = journal;
  const std::size_t gradient = digit.find("\"gradient\":[", third) + 15;
  digit[gradient] = digit[gradient] == '7' ? '3' : '7';
  goes_on(digit, 1, "checksum");
}

TEST_CASE("resume: records with a right checksum that this run cannot have written are cut off as well") {
  const WorkingDirectory here;
  costate_json(with(kRun, {"--max-evaluations", "3"}), here.path());
  const auto path = here / "out/evaluations.jsonl";
  const std::string journal = file_text(path), header = journal.substr(0, journal.find('\n') + 1);
  const Json first = Json::parse(journal.substr(header.size(), journal.find('\n', header.size()) - header.size()));
  const auto goes_on = [&](const std::function<void(Json&)>& change, const std::string& why) {
    INFO(why);
    write_text(path, header);
    Json record = first;
    record.erase("checksum");
    change(record);
    {
      auto written = costate::Journal::open(path, Json::parse(header).at("header"), true);
      written.append(record);
    }
    const Outcome o = costate::test::run_costate(with(kRun, {"--resume", "--json"}), here.path());
    CHECK(o.status == 0);
    CHECK_THAT(o.err, Contains("record 1 is damaged") && Contains(why));
    check_same(costate::test::one_object(o.out), undisturbed());
  };
  goes_on([](Json& r) { r["gradient"].push_back(1.0); }, "3 entries where 2 belong");
  goes_on([](Json& r) { r["parameters"] = Json::array({1.5}); }, "1 entries where 2 belong");
  goes_on([](Json& r) { r["parameters"][0] = 17.0; }, "outside of its bounds");
  goes_on([](Json& r) { r["psi"] = "nan"; }, "not finite");
  goes_on([](Json& r) { r["index"] = 4; }, "where 1 belongs");
  goes_on([](Json& r) { r["constraints"] = Json::array({0.5}); }, "1 entries where 0 belong");
  goes_on([](Json& r) { r.erase("counters"); }, "counters");
}

TEST_CASE("resume: the limit of evaluations counts those of the journal") {
  for (const std::string algorithm : {"lbfgs", "mma", "slsqp"}) {
    INFO(algorithm);
    const WorkingDirectory here;
    const auto evaluations = [&](const Words& options) {
      return costate_json(with({"optimize", kFiveBar, "--output", "out", "--no-certificate", "--stop-value=-1",
                                "--algorithm", algorithm},
                               options),
                          here.path());
    };
    for (const int limit : {1, 2, 5}) {
      const Json j = evaluations({"--max-evaluations", std::to_string(limit)});
      CHECK(j.at("evaluations").size() == static_cast<std::size_t>(limit));
      CHECK(j.at("converged") == false);
      CHECK_THAT(j.at("stop_reason").get<std::string>(), Contains("limit"));
    }
    CHECK(evaluations({"--resume", "--max-evaluations", "8"}).at("evaluations").size() == 8);
    CHECK(evaluations({"--resume", "--max-evaluations", "4"}).at("evaluations").size() == 4);
    CHECK(lines_of(here / "out/evaluations.jsonl") == 9);  // what is known is kept
  }
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
    // The best point so far, and a report and a summary that say what they are.
    CHECK(here.entries() ==
          Words{"out", "out/evaluations.jsonl", "out/optimize.json", "out/optimized.toml", "out/report.html"});
    const Json best = costate::test::one_object(file_text(here / "out/optimize.json"));
    CHECK(best.at("status") == "interrupted");
    CHECK(best.at("converged") == false);
    double least = HUGE_VAL;
    for (const Json& e : best.at("evaluations")) least = std::min(least, e.at("psi").get<double>());
    CHECK(best.at("psi") == least);
    CHECK(costate_json({"simulate", "out/optimized.toml", "--no-files"}, here.path()).at("parameters") ==
          best.at("parameters"));
    CHECK_THAT(file_text(here / "out/report.html"), Contains("did not come to its end") && Contains("interrupted"));
    check_same(costate_json(with(kRun, {"--resume"}), here.path()), undisturbed());
  }
}

TEST_CASE("interrupted: every command stops soon and leaves nothing") {
  for (const Words& command :
       {Words{"simulate", "--formulation", "baumgarte", "--t-end", "1e4"},
        Words{"gradient", "--formulation", "baumgarte", "--method", "cvodes-forward", "--t-end", "1e4"},
        Words{"gradient", "--formulation", "baumgarte", "--method", "differences", "--t-end", "1000"},
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

TEST_CASE("a resumed optimization says what the undisturbed one said") {
  // Over 15 s its constraints drift: a warning of the evaluations, whose runs are not made again.
  const WorkingDirectory here;
  const Words run = {"optimize",          kFiveBar, "--t-end",  "15", "--rtol", "1e-9",
                     "--max-evaluations", "2",      "--output", "out"};
  const Json whole = costate_json(run, here.path());
  REQUIRE_THAT(whole.at("warnings").dump(), Contains("drift"));
  const Json resumed = costate_json(with(run, {"--resume"}), here.path());
  CHECK(resumed.at("warnings") == whole.at("warnings"));
}
