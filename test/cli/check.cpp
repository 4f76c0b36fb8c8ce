// costate check: it passes good scenes, and finds a wrong method with its row and parameter. The wrong ones live in a
// second program made of the tool's objects and programs/wrong_methods.cpp.
#include <signal.h>

#include <catch2/catch.hpp>
#include <set>

#include "five_bar.h"
#include "process.h"

using Catch::Matchers::Contains;
using costate::test::Connection;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::kFiveBar;
using costate::test::kGradient;
using costate::test::one_object;
using costate::test::Outcome;
using costate::test::Process;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;

namespace {

using Words = std::vector<std::string>;

Outcome check_with_wrong_methods(const Words& options) {
  const WorkingDirectory here;
  Words arguments = {"check", kFiveBar, "--no-files"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return Process(COSTATE_WITH_WRONG_METHODS, arguments, here.path()).finish();
}

const Json* find_row(const Json& result, const std::string& formulation, const std::string& method) {
  for (const Json& row : result.at("rows"))
    if (row.at("formulation") == formulation && row.at("method") == method) return &row;
  return nullptr;
}

}  // namespace

TEST_CASE("check: the five-bar passes, a row for every combination") {
  const WorkingDirectory here;
  const Json j = costate_json({"check", kFiveBar}, here.path());
  CHECK(j.at("status") == "ok");
  CHECK(j.at("disagreements").empty());
  for (const std::string formulation : {"index1", "index2", "baumgarte", "penalty"})
    for (const std::string method : {"idas-forward", "idas-adjoint", "cvodes-forward", "cvodes-adjoint", "differences"}) {
      INFO(formulation << " x " << method);
      const Json* row = find_row(j, formulation, method);
      if (formulation == "index2" && method.rfind("cvodes", 0) == 0) {
        CHECK(row == nullptr);
        continue;
      }
      REQUIRE(row != nullptr);
      CHECK(row->at("status") == "ok");
      CHECK(row->at("error").get<double>() < 1e-5);
      CHECK(row->at("gradient").at("L01").get<double>() == Approx(kGradient.at("L01")).epsilon(1e-5));
      CHECK(row->at("time_ratio").get<double>() > 0.3);
    }
  CHECK(j.at("reference").at("distance_to_differences").get<double>() < 1e-8);
}

TEST_CASE("check: at the optimum, where psi and gradient vanish, tolerances are not taken for mistakes") {
  const WorkingDirectory here;
  costate_json({"optimize", kFiveBar}, here.path());
  const Json j = costate_json({"check", "results/five_bar/optimized.toml"}, here.path());
  CHECK(j.at("status") == "ok");
}

TEST_CASE("check: text") {
  const WorkingDirectory here;
  const Outcome o = costate::test::run_costate({"check", kFiveBar, "--methods", "idas-adjoint,cvodes-forward", "--all"}, here.path());
  CHECK(o.status == 0);
  CHECK_THAT(o.out, Contains("reference") && Contains("ratio") && Contains("all agree") &&
                        Contains("index2") && Contains("Nearest that works"));
}

TEST_CASE("check: --all has a row for every combination of the table, the impossible ones with their reason") {
  const WorkingDirectory here;
  const Json table = costate_json({"list"}, here.path()).at("combinations");
  const Json j = costate_json({"check", kFiveBar, "--all", "--no-files", "--t-end", "0.5"}, here.path());
  REQUIRE(j.at("rows").size() == table.size());
  for (const Json& entry : table) {
    const std::string formulation = entry.at("formulation"), method = entry.at("method");
    INFO(formulation << " x " << method);
    const Json* row = find_row(j, formulation, method);
    REQUIRE(row != nullptr);
    CHECK(row->at("status") == (entry.at("possible") ? "ok" : "refused"));
    CHECK(row->contains("refused") != entry.at("possible").get<bool>());
    if (!entry.at("possible")) CHECK(row->at("refused") == entry.at("refused"));
    for (const char* key : {"psi", "gradient", "error", "counters", "wall_s"}) CHECK(row->contains(key));
  }
}

TEST_CASE("check: what a method cannot do on this scene is a refused row, and the others still run") {
  const WorkingDirectory here;
  const std::vector<std::string> scene = {"check", kFiveBar, "--no-files", "--t-end", "0.5", "--set",
                                          "cost={running=[{kind='square',output='P2.x_ddot'}]}"};
  const auto with = [&](std::vector<std::string> options) {
    options.insert(options.begin(), scene.begin(), scene.end());
    return options;
  };
  const auto arguments =
      with({"--formulations", "index3,penalty-second-order", "--methods", "hand-adjoint,hand-tangent"});
  const Json j = costate_json(arguments, here.path());
  CHECK(j.at("status") == "ok");
  const Json& row = *find_row(j, "penalty-second-order", "hand-adjoint");
  CHECK(row.at("status") == "refused");
  CHECK_THAT(row.at("refused").get<std::string>(), Contains("accelerations") && Contains("first-order"));
  CHECK(row.at("gradient").is_null());
  CHECK(find_row(j, "penalty-second-order", "hand-tangent")->at("status") == "ok");
  CHECK(find_row(j, "index3", "hand-adjoint")->at("status") == "ok");
  CHECK_THAT(costate::test::run_costate(arguments, here.path()).out,
             Contains("hand-adjoint     -- The second-order adjoint") && Contains("all agree"));
  // Nothing that ran is no agreement.
  const Json none =
      costate_json(with({"--formulations", "penalty-second-order", "--methods", "hand-adjoint"}), here.path(), 1);
  CHECK(none.at("status") == "failed");
}

TEST_CASE("check: a wrong gradient is found with its row and parameter") {
  const Outcome o = check_with_wrong_methods({"--formulations", "index1,baumgarte", "--methods",
                                              "idas-adjoint,cvodes-forward,wrong-adjoint,right-adjoint", "--json"});
  CHECK(o.status == 3);
  const Json j = costate::test::one_object(o.out);
  CHECK(j.at("status") == "disagreement");
  REQUIRE(j.at("disagreements").size() == 2);
  for (const std::string formulation : {"index1", "baumgarte"}) {
    INFO(formulation);
    for (const std::string method : {"idas-adjoint", "cvodes-forward", "right-adjoint"})
      CHECK(find_row(j, formulation, method)->at("status") == "ok");
    const Json& row = *find_row(j, formulation, "wrong-adjoint");
    CHECK(row.at("status") == "disagreement");
    CHECK(row.at("error").get<double>() == Approx(2e-4 * 3.21160410 * 2.0616 / (4.22881086 * 2.2361)).epsilon(0.02));
    CHECK_THAT(o.err, Contains(formulation + " x wrong-adjoint, parameter L02"));
  }
}

TEST_CASE("check: a wrong cost, a gradient that is no number and a failing run") {
  const auto found = [](const std::string& method, const std::string& what) {
    INFO(method);
    const Outcome o = check_with_wrong_methods({"--formulations", "index1", "--methods", "idas-adjoint," + method});
    CHECK(o.status == 3);
    CHECK_THAT(o.err, Contains("index1 x " + method) && Contains(what));
    CHECK_THAT(o.out, Contains("DISAGREEMENT: index1 x " + method) && !Contains("all agree"));
  };
  found("wrong-cost", "psi");
  found("nan-adjoint", "parameter L01");
  found("failing-adjoint", "t = 1.25 s");
}

TEST_CASE("check: rows are told as they end, and Ctrl-C keeps them") {
  const WorkingDirectory here;
  Process process(COSTATE_EXECUTABLE, {"check", kFiveBar}, here.path(), Connection::terminal_errors);
  REQUIRE(process.wait_until([&] { return process.seen().find(" 2/") != std::string::npos; }));
  process.send(SIGINT);
  const Outcome o = process.finish();
  CHECK(o.status == 130);
  CHECK_THAT(o.terminal, Contains("interrupted") && Contains("rows had been run; they stand."));
  CHECK_THAT(o.out, Contains("reference: baumgarte") && Contains("augmented-lagrangian") && !Contains("all agree"));
  const Json j = one_object(file_text(here / "results/five_bar/check.json"));
  CHECK(j.at("status") == "interrupted");
  CHECK(j.at("rows").size() >= 2);
}

TEST_CASE("check: nothing to check is a mistake, not an agreement") {
  const WorkingDirectory here;
  for (const Words& options : {Words{"--formulations", "index2", "--methods", "cvodes-adjoint,cvodes-forward"},
                               Words{"--set", "run.parameters=[]"}}) {
    Words arguments = {"check", kFiveBar};
    arguments.insert(arguments.end(), options.begin(), options.end());
    CHECK(costate_json(arguments, here.path(), 1).at("status") == "failed");
  }
  CHECK(here.entries().empty());
}

TEST_CASE("check: redundant rows are named by the formulations that cannot carry them; the others agree") {
  // The five-bar with a bar's length kept twice.
  const WorkingDirectory here;
  costate::test::write_text(here / "twice.toml", costate::test::file_text(kFiveBar) +
                                                     "\n[distance.again]\nfrom = \"A\"\nto = \"P1\"\n");
  const Json j = costate_json({"check", "twice.toml", "--no-files", "--methods",
                               "idas-forward,cvodes-adjoint,hand-adjoint,discrete-adjoint,differences"},
                              here.path());
  CHECK(j.at("status") == "ok");
  CHECK(j.at("reference").at("formulation") == "augmented-lagrangian");
  int run = 0, redundant = 0;
  for (const Json& row : j.at("rows")) {
    INFO(row.dump(1));
    if (row.at("status") == "refused") {
      if (row.at("refused").get<std::string>().find("distance.again.length") != std::string::npos) ++redundant;
      continue;
    }
    ++run;
    CHECK(row.at("status") == "ok");
  }
  CHECK(run >= 15);       // penalty, augmented Lagrangian and Maggi
  CHECK(redundant >= 10); // index 1 to 3 and Baumgarte
}
