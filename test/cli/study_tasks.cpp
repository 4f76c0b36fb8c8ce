// costate study with cycles and fits: each run is the command alone, failed ones have their reason, finished ones are
// kept.
#include <signal.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "csv_table.h"
#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kWalker = COSTATE_MODELS_DIR "/walker/simplest.toml";
const std::string kRayleigh = COSTATE_MODELS_DIR "/cycles/rayleigh.toml";
const std::string kSwing = COSTATE_MODELS_DIR "/identification/pendulum.toml";

std::string study_of(const std::string& scene, const std::string& rest) {
  return "[[design]]\nname = \"d\"\nscene = \"" + scene + "\"\n" + rest;
}

double modulus(const Json& multipliers) {
  double largest = 0;
  for (const Json& m : multipliers) largest = std::max(largest, std::hypot(m[0].get<double>(), m[1].get<double>()));
  return largest;
}

}  // namespace

TEST_CASE("study: gaits of the walker over its slope, one of which there is none") {
  const WorkingDirectory here;
  // The slope is a parameter of two numbers, with factors of -1.
  write_text(here / "s.toml", study_of(kWalker,
                                       "task = \"cycle\"\nkind = \"grid\"\npareto = [\"period_s\", \"multiplier\"]\n"
                                       "options = { no_estimate = true, no_derivatives = true }\n"
                                       "[design.vary]\nslope = { from = 0.004, to = 0.019, steps = 4 }\n"));
  const Json j = costate_json({"study", "s.toml", "--output", "out"}, here.path(), 1);
  CHECK(j.at("status") == "failed");
  const Table t = read_table(file_text(here / "out/d.csv"));
  REQUIRE(t.rows.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) CHECK(t.column("slope")[i] == Approx(0.004 + 0.005 * static_cast<double>(i)));
  const auto period = t.column("period_s"), multiplier = t.column("multiplier"), stable = t.column("stable");
  // On the least slope the walker falls back: no gait, and the reason.
  const Json& fallen = j.at("runs").at(0);
  CHECK(fallen.at("status") == "failed");
  CHECK_THAT(fallen.at("error").get<std::string>(), Contains("does not come again between") && Contains("t_end_s"));
  CHECK(t.texts("status") == std::vector<std::string>{"failed", "ok", "ok", "ok"});
  CHECK(
      (std::isnan(period[0]) && std::isnan(multiplier[0]) && std::isnan(stable[0]) && std::isnan(t.column("psi")[0])));
  for (const std::size_t i : {std::size_t{1}, std::size_t{3}}) {
    const std::string slope = t.texts("slope")[i];
    const Json alone =
        costate_json({"cycle", kWalker, "--no-files", "--no-estimate", "--no-derivatives", "--set",
                      "contact.left.ground_angle_rad=-" + slope, "--set", "contact.right.ground_angle_rad=-" + slope},
                     here.path());
    CHECK(period[i] == alone.at("period_s").get<double>());
    CHECK(multiplier[i] == modulus(alone.at("multipliers")));
    CHECK(stable[i] == (alone.at("stable").get<bool>() ? 1 : 0));
    CHECK(t.column("psi")[i] == alone.at("psi").get<double>());
  }
  CHECK((stable[1] == 1 && stable[3] == 0));
  CHECK_THAT(file_text(here / "out/study.txt"),
             Contains("d: 3 of 4 points") && Contains("period_s 3.88") && Contains("stable: 2 of 3"));
  CHECK_THAT(file_text(here / "out/report.html"), Contains("multiplier") && Contains("does not come again"));
  CHECK(j.at("pareto").at("d").at("front").at(0) == "d.2");

  // Once more: what is finished is kept, what failed is tried again.
  const Json again = costate_json({"study", "s.toml", "--output", "out"}, here.path(), 1);
  for (std::size_t i = 1; i < 4; ++i) {
    CHECK(again.at("runs").at(i).at("status") == "kept");
    CHECK(again.at("runs").at(i).at("outputs") == j.at("runs").at(i).at("outputs"));
  }
}

TEST_CASE("study: cycles with their derivatives, and without a cost there is no psi") {
  const WorkingDirectory here;
  const std::string rest =
      "task = \"cycle\"\nkind = \"grid\"\noptions = { rtol = 1e-7 }\n"
      "[design.vary]\nstiffness = { from = 1, to = 2, steps = 2 }\n";
  write_text(here / "s.toml", study_of(kRayleigh, rest));
  costate_json({"study", "s.toml", "--output", "out"}, here.path());
  const Table t = read_table(file_text(here / "out/d.csv"));
  const Json alone = costate_json(
      {"cycle", kRayleigh, "--no-files", "--rtol", "1e-7", "--set", "torsion_spring.shaft.stiffness_N_m_per_rad=2.0"},
      here.path());
  CHECK(t.column("period_s")[1] == alone.at("period_s").get<double>());
  CHECK(t.column("dpsi/dpush")[1] == alone.at("gradient").at("push").get<double>());
  CHECK(t.column("dperiod_s/dstiffness")[1] == alone.at("period_gradient").at("stiffness").get<double>());
  CHECK(t.column("dmultiplier/dpush")[1] == alone.at("multiplier_gradient").at("push").get<double>());

  std::string scene = file_text(kRayleigh);
  const std::string cost = "[[cost.running]]\nkind = \"square\"\noutput = \"disk.angle\"\n";
  scene.replace(scene.find(cost), cost.size(), "");
  write_text(here / "free.toml", scene);
  write_text(here / "s.toml", study_of("free.toml", rest));
  const Json j = costate_json({"study", "s.toml", "--output", "free"}, here.path());
  const Table bare = read_table(file_text(here / "free/d.csv"));
  CHECK(std::isnan(bare.column("psi")[0]));
  // Without the cost's error in the steps: to 100 rtol.
  CHECK(bare.column("period_s")[1] == Approx(t.column("period_s")[1]).epsilon(1e-5));
  const std::string text = file_text(here / "free/study.txt");
  CHECK_THAT(text, Contains("d: 2 of 2 points") && Contains("period_s") && !Contains("psi 0"));
  CHECK_THAT(file_text(here / "free/report.html"), Contains("the least period_s"));
}

TEST_CASE("study: a fit from many starts, with standard errors, and one that does not come to its end") {
  const WorkingDirectory here;
  write_text(here / "s.toml",
             "[options]\nmax_evaluations = 1\nconfidence = 0.9\n" +  // each run takes what its command has
                 ("[[run]]\nname = \"short\"\ntask = \"fit\"\noptions = { max_iterations = 1 }\nscene = \"" + kSwing) +
                 "\"\n[[run]]\nname = \"whole\"\ntask = \"fit\"\nscene = \"" + kSwing +
                 "\"\n[[run]]\nname = \"other\"\noptions = { no_certificate = true, t_end = 0.1 }\nscene = "
                 "\"" COSTATE_MODELS_DIR "/damped_pendulum/damped_pendulum.toml\"\n" +
                 study_of(kSwing,
                          "task = \"fit\"\nkind = \"grid\"\n[design.vary]\n"
                          "\"bar.rod.length_m\" = { from = 0.4, to = 0.6, steps = 2 }\n"));
  const Json j = costate_json({"study", "s.toml", "--output", "out"}, here.path(), 1);
  const Json& runs = j.at("runs");
  REQUIRE(runs.size() == 5);
  CHECK(runs.at(0).at("status") == "failed");
  CHECK_THAT(runs.at(0).at("error").get<std::string>(), Contains("stopped after 1 iteration"));
  for (std::size_t i = 1; i < 5; ++i) CHECK(runs.at(i).at("status") == "ok");
  CHECK(runs.at(2).at("evaluations") == 1);
  CHECK(runs.at(2).at("task") == "optimize");
  const Table t = read_table(file_text(here / "out/d.csv"));
  for (std::size_t i = 0; i < 2; ++i) {
    const Json alone = costate_json({"fit", kSwing, "--no-files", "--confidence", "0.9", "--set",
                                     "bar.rod.length_m=" + t.texts("bar.rod.length_m")[i]},
                                    here.path());
    CHECK(t.column("psi")[i] == alone.at("chi_square").get<double>());
    for (const std::string name : {"length", "damping", "released"}) {
      const Json& p = alone.at("parameters").at(name);
      CHECK(t.column(name + ".after")[i] == p.at("value").get<double>());
      CHECK(t.column(name + ".standard_error")[i] == p.at("standard_error").get<double>());
    }
  }
  const Table all = read_table(file_text(here / "out/study.csv"));
  CHECK(all.column("length.after")[1] == runs.at(1).at("parameters_after").at("length").get<double>());
  CHECK(all.column("length.standard_error")[1] == runs.at(1).at("standard_errors").at("length").get<double>());
  CHECK(std::isnan(all.column("length.after")[0]));
  CHECK_THAT(file_text(here / "out/study.txt"), Contains("2 of 2 starts came there") && Contains("standard error") &&
                                                    Contains("length 0.45 -> 0.529995 +- 0.00018"));
  CHECK(std::filesystem::exists(here / "out/whole/fitted.toml"));
}

TEST_CASE("study: options are those of the task's command") {
  const WorkingDirectory here;
  const auto complaint = [&](const std::string& text) {
    write_text(here / "s.toml", text);
    const Outcome o = run_costate({"study", "s.toml", "--output", "out"}, here.path());
    CHECK(o.status == 1);
    CHECK_THAT(o.err, Contains("s.toml:"));
    return o.err;
  };
  const std::string vary = "kind = \"grid\"\n[design.vary]\nstiffness = { from = 1, to = 2, steps = 2 }\n";
  const auto cycle = [&](const std::string& options) {
    return complaint(study_of(kRayleigh, "task = \"cycle\"\noptions = { " + options + " }\n" + vary));
  };
  CHECK_THAT(cycle("method = \"idas-adjoint\""), Contains("'method'") && Contains("costate cycle"));
  CHECK_THAT(cycle("continue = \"stiffness=1..2\""), Contains("'continue'"));
  CHECK_THAT(cycle("setle = 3"), Contains("Did you mean 'settle'?"));
  CHECK_THAT(cycle("settle = \"long\""), Contains("'settle'") && Contains("long"));
  CHECK_THAT(complaint("[options]\nmax_evaluations = 3\n" + study_of(kRayleigh, "task = \"cycle\"\n" + vary)),
             Contains("'max_evaluations'"));
  CHECK_THAT(complaint(study_of(kRayleigh, "task = \"cicle\"\n" + vary)), Contains("fit, cycle"));
  CHECK_THAT(complaint(study_of(kRayleigh, "task = \"fit\"\n" + vary)), Contains("[[cost.samples]]"));
  CHECK_THAT(complaint(study_of(kSwing,
                                "task = \"cycle\"\nkind = \"grid\"\n[design.vary]\nlength = { from = 0.4, to = "
                                "0.5, steps = 2 }\n")),
             Contains("no [cycle]"));
  CHECK(here.entries() == std::vector<std::string>{"s.toml"});
}

TEST_CASE("study: cycles that are interrupted are kept as far as they came") {
  const WorkingDirectory here;
  // Some seconds each, with estimates and derivatives.
  write_text(here / "s.toml", study_of(kWalker,
                                       "task = \"cycle\"\nkind = \"grid\"\n"
                                       "[design.vary]\nslope = { from = 0.009, to = 0.0095, steps = 3 }\n"));
  const std::vector<std::string> words = {"study", "s.toml", "--output", "out", "--jobs", "1"};
  Process p(COSTATE_EXECUTABLE, words, here.path());
  REQUIRE(p.wait_until([&] { return std::filesystem::exists(here / "out/d.2/log.txt"); }));
  p.send(SIGINT);
  CHECK(p.finish().status == 130);
  const Table before = read_table(file_text(here / "out/d.csv"));
  CHECK(before.texts("status").at(0) == "ok");
  CHECK(before.texts("status").at(2) == "interrupted");
  const Json j = costate_json(words, here.path());
  CHECK(j.at("runs").at(0).at("status") == "kept");
  CHECK(j.at("runs").at(1).at("status") == "ok");
  const Table after = read_table(file_text(here / "out/d.csv"));
  CHECK(after.column("period_s").at(0) == before.column("period_s").at(0));
  CHECK(after.column("dperiod_s/dslope").at(0) == before.column("dperiod_s/dslope").at(0));
}
