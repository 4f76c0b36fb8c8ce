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

TEST_CASE("check: discrete methods on every scheme that is asked for") {
  const WorkingDirectory here;
  const Json j =
      costate_json({"check", kFiveBar, "--formulations", "baumgarte,index2", "--methods",
                    "discrete-tangent,discrete-adjoint", "--integrators", "dopri5,radau5,radau9", "--no-motions"},
                   here.path());
  CHECK(j.at("status") == "ok");
  std::set<std::string> found;
  for (const Json& row : j.at("rows")) {
    INFO(row.dump());
    CHECK(row.at("status") == "ok");
    CHECK(row.at("gradient").at("L01").get<double>() == Approx(kGradient.at("L01")).epsilon(1e-5));
    found.insert(row.at("formulation").get<std::string>() + " " + row.at("method").get<std::string>() + " " +
                 row.at("integrator").get<std::string>());
  }
  std::set<std::string> expected;
  for (const std::string method : {" discrete-tangent ", " discrete-adjoint "}) {
    for (const std::string scheme : {"dop853", "dopri5", "radau5", "radau9"})
      expected.insert("baumgarte" + method + scheme);
    for (const std::string scheme : {"radau5", "radau9"}) expected.insert("index2" + method + scheme);
  }
  CHECK(found == expected);
  CHECK(j.at("rows").size() == expected.size());
  const Json refused = costate_json({"check", kFiveBar, "--integrators", "radau7", "--no-files"}, here.path(), 1);
  CHECK_THAT(refused.at("error").get<std::string>(), Contains("radau7") && Contains("--integrators"));
}

TEST_CASE("check: the five-bar passes, a row for every combination") {
  const WorkingDirectory here;
  const Json j = costate_json({"check", kFiveBar}, here.path());
  CHECK(j.at("status") == "ok");
  CHECK(j.at("disagreements").empty());
  for (const std::string formulation : {"index1", "index2", "baumgarte", "penalty"})
    for (const std::string method :
         {"idas-forward", "idas-adjoint", "cvodes-forward", "cvodes-adjoint", "differences"}) {
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
  // Motions of each formulation on each of its integrators: 11 formulations, index3 by fixed steps, too.
  CHECK(j.at("motions").size() >= 14);
  for (const Json& motion : j.at("motions")) {
    INFO(motion.dump(1));
    CHECK(motion.at("status") == "ok");
    CHECK(motion.at("error").get<double>() < (motion.at("integrator") == "fixed" ? 1e-2 : 1e-4));
    CHECK_FALSE(motion.at("quantity").get<std::string>().empty());
  }
}

TEST_CASE("check: at the optimum, where psi and gradient vanish, tolerances are not taken for mistakes") {
  const WorkingDirectory here;
  costate_json({"optimize", kFiveBar}, here.path());
  const Json j = costate_json({"check", "results/five_bar/optimized.toml"}, here.path());
  CHECK(j.at("status") == "ok");
}

TEST_CASE("check: text") {
  const WorkingDirectory here;
  const Outcome o =
      costate::test::run_costate({"check", kFiveBar, "--methods", "idas-adjoint,cvodes-forward", "--all"}, here.path());
  CHECK(o.status == 0);
  CHECK_THAT(o.out, Contains("reference") && Contains("ratio") && Contains("all agree") && Contains("index2") &&
                        Contains("Nearest that works"));
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
  const std::vector<std::string> scene = {"check",
                                          kFiveBar,
                                          "--no-files",
                                          "--t-end",
                                          "0.5",
                                          "--set",
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
  const auto found = [](const std::string& method, const std::string& what, int status, const std::string& word) {
    INFO(method);
    const Outcome o = check_with_wrong_methods({"--formulations", "index1", "--methods", "idas-adjoint," + method});
    CHECK(o.status == status);
    CHECK_THAT(o.err, Contains("index1 x " + method) && Contains(what));
    CHECK_THAT(o.out, Contains(word + ": index1 x " + method) && !Contains("all agree"));
  };
  found("wrong-cost", "psi", 3, "DISAGREEMENT");
  // What has no result disagrees with nothing, but the check has failed.
  found("nan-adjoint", "with respect to 'L01' is nan", 1, "FAILED");  // gradient() itself refuses it
  found("failing-adjoint", "t = 1.25 s", 1, "FAILED");
  const Outcome json = check_with_wrong_methods(
      {"--formulations", "index1", "--methods", "idas-adjoint,failing-adjoint,wrong-cost", "--json"});
  CHECK(json.status == 3);
  const Json j = one_object(json.out);
  CHECK(j.at("status") == "disagreement");
  CHECK(j.at("disagreements").size() == 1);
  CHECK(j.at("failures").size() == 1);
}

TEST_CASE("check: rows are told as they end, and Ctrl-C keeps them") {
  const WorkingDirectory here;
  Process process(COSTATE_EXECUTABLE, {"check", kFiveBar}, here.path(), Connection::terminal_errors);
  // Rows run side by side: the second may end before the first.
  REQUIRE(process.wait_until([&] {
    return process.seen().find(" 1/") != std::string::npos && process.seen().find(" 2/") != std::string::npos;
  }));
  process.send(SIGINT);
  const Outcome o = process.finish();
  CHECK(o.status == 130);
  CHECK_THAT(o.terminal, Contains("interrupted") && Contains("rows had been run; they stand."));
  CHECK_THAT(o.out, Contains("reference: baumgarte") && Contains("augmented-lagrangian") && !Contains("all agree"));
  const Json j = one_object(file_text(here / "results/five_bar/check.json"));
  CHECK(j.at("status") == "interrupted");
  CHECK(j.at("rows").size() >= 2);
}

TEST_CASE("check: a wrong reaction is found with its time and both values, though psi and gradient are right") {
  const Outcome o =
      check_with_wrong_methods({"--formulations", "wrong-reaction", "--methods", "cvodes-forward", "--json"});
  CHECK(o.status == 3);
  const Json j = one_object(o.out);
  CHECK(find_row(j, "wrong-reaction", "cvodes-forward")->at("status") == "ok");
  REQUIRE(j.at("motions").size() == 3);  // on every integrator of right-hand sides
  for (const Json& motion : j.at("motions")) CHECK(motion.at("status") == "disagreement");
  const Json& motion = j.at("motions")[0];
  CHECK(motion.at("integrator") == "cvodes");
  const double found = motion.at("value"), expected = motion.at("expected");
  CHECK(found == Approx(1.01 * expected).epsilon(1e-6));
  // Its own state's equations of motion tell, too.
  CHECK(motion.at("equations_error").get<double>() > 1e-3);
  CHECK_THAT(o.err, Contains("the motion of wrong-reaction on cvodes: " + motion.at("quantity").get<std::string>() +
                             " at t = "));
}

TEST_CASE("check: where a gradient is zero, noise is not taken for a mistake, and a wrong one is found") {
  const WorkingDirectory here;
  const std::string scene = R"([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0
[bar.rod]
from = "O"
to = "P"
mass_kg = 1.5
length_m = 1
[start]
given = ["P.y"]
[[cost.running]]
kind = "square"
output = "P.y"
[run]
t_end_s = 1.5
parameters = ["bar.rod.mass_kg"]
)";
  // A pendulum's motion does not know its mass.
  costate::test::write_text(here / "zero.toml", scene);
  const Json j = costate_json({"check", "zero.toml", "--no-files"}, here.path());
  CHECK(j.at("status") == "ok");
  CHECK(j.at("disagreements").empty());
  CHECK(j.at("inaccurate").empty());
  Words arguments = {"check", "zero.toml", "--no-files", "--json", "--formulations", "index1", "--methods", "not-zero"};
  const Outcome o = Process(COSTATE_WITH_WRONG_METHODS, arguments, here.path()).finish();
  CHECK(o.status == 3);
  CHECK(find_row(one_object(o.out), "index1", "not-zero")->at("status") == "disagreement");
}

TEST_CASE("check: a row that takes too long is cut, which is neither right nor wrong") {
  const Outcome o =
      check_with_wrong_methods({"--formulations", "index1", "--methods", "idas-adjoint,slow-adjoint", "--no-motions"});
  CHECK(o.status == 0);
  CHECK_THAT(o.out, Contains("cut: after") && Contains("all that ended agree") && Contains("--patience"));
  // Rows are told as they end where stderr is no terminal, too.
  CHECK_THAT(o.err, Contains("1/2 index1") && Contains("ok, error"));
  // Nothing that ended is no agreement.
  const Outcome none =
      check_with_wrong_methods({"--formulations", "index1", "--methods", "slow-adjoint", "--no-motions"});
  CHECK(none.status == 1);
  CHECK_THAT(none.err, Contains("raise --patience"));
}

TEST_CASE("check: by a reference without digits rows are not judged further, and say so") {
  // Flat at 0.708 s the bars may go on in two ways, of which each tolerance takes one; before that all agree. Which one
  // is of rounding: of five gravities the reference's runs part at some.
  const auto check = [](const std::string& t_end, int status, const std::string& gravity = "-9.81") {
    return costate_json({"check", COSTATE_MODELS_DIR "/n_four_bar/n_four_bar_1.toml", "--no-files", "--no-motions",
                         "--formulations", "index1", "--methods", "hand-adjoint,hand-tangent", "--parameters", "H",
                         "--t-end", t_end, "--set", "gravity.y_m_per_s2=" + gravity},
                        WorkingDirectory().path(), status);
  };
  int parted = 0;
  for (const char* gravity : {"-9.81", "-9.7", "-9.4", "-9.9", "-10"}) {
    INFO(gravity);
    const Json lost = check("1.5", 3, gravity);
    if (!(lost.at("reference").at("distance_to_differences") > 0.5)) continue;
    ++parted;
    CHECK(lost.at("disagreements").size() == 3);  // the rows', and the reference's own
    for (const char* method : {"hand-adjoint", "hand-tangent"})
      CHECK_THAT(find_row(lost, "index1", method)->at("remark").get<std::string>(), Contains("no digit itself"));
  }
  CHECK(parted >= 2);
  CHECK(check("0.6", 0).at("disagreements").empty());
}

TEST_CASE("check: soft constraints are excused by O(1/alpha) alone, and only while that is small") {
  const WorkingDirectory here;
  const auto check = [&](const std::string& alpha, int status) {
    return costate_json({"check", kFiveBar, "--no-files", "--no-motions", "--formulations", "penalty", "--methods",
                         "cvodes-forward", "--penalty-alpha", alpha},
                        here.path(), status);
  };
  // psi is off by 2 (1/alpha) and the gradient by as much more: what ten times alpha takes away tells.
  const Json soft = check("1e4", 0);
  CHECK_THAT(find_row(soft, "penalty", "cvodes-forward")->at("remark").get<std::string>(), Contains("O(1/alpha)"));
  const Json wrong = check("10", 3);
  CHECK(find_row(wrong, "penalty", "cvodes-forward")->at("status") == "disagreement");
  // A formulation that carries redundant rows and agrees with itself is excused from nothing.
  const Outcome o = check_with_wrong_methods({"--formulations", "wrong-motion", "--methods", "cvodes-forward"});
  CHECK(o.status == 1);  // its constraints no longer hold, so that it has no result
  CHECK_THAT(o.err, Contains("failed: wrong-motion x cvodes-forward") && Contains("no longer hold"));
}

TEST_CASE("check: drivers with kinks, which some formulations refuse and the others cross, are no disagreement") {
  const WorkingDirectory here;
  const Json j = costate_json({"check", COSTATE_SOURCE_DIR "/test/cases/driven_corner.toml", "--no-files", "--methods",
                               "cvodes-forward,idas-adjoint"},
                              here.path());
  CHECK(j.at("status") == "ok");
  CHECK(find_row(j, "maggi", "cvodes-forward")->at("status") == "ok");
  CHECK(find_row(j, "maggi", "cvodes-forward")->at("psi").get<double>() == Approx(2.7610379).epsilon(1e-6));
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

TEST_CASE("check: redundant rows are named by the formulations that cannot carry them, the others agree") {
  // The five-bar with a bar's length kept twice.
  const WorkingDirectory here;
  costate::test::write_text(here / "twice.toml",
                            costate::test::file_text(kFiveBar) + "\n[distance.again]\nfrom = \"A\"\nto = \"P1\"\n");
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
  CHECK(run >= 15);        // penalty, augmented Lagrangian and Maggi
  CHECK(redundant >= 10);  // index 1 to 3 and Baumgarte
}

TEST_CASE("check: errors that fall with the tolerance disagree with nothing where no tighter run is to be had") {
  // By idas-forward 35 times what is expected, at a hundredth of the tolerance a 33rd of that, and IDAS does not get on
  // at less.
  const WorkingDirectory here;
  const Json j = costate_json({"check", COSTATE_MODELS_DIR "/heavy_top/heavy_top.toml", "--formulations", "baumgarte",
                               "--methods", "idas-forward,cvodes-forward", "--no-motions", "--no-files"},
                              here.path());
  CHECK(j.at("disagreements").empty());
  CHECK_THAT(j.dump(), Contains("limited by the tolerance"));
}
