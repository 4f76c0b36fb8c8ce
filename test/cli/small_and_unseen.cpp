// What commands said of psi far below absolute tolerances, of cycles of several returns, of rests that cannot be and of
// files of another run, before: numbers that were wrong in silence, each with what is right.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kScenes = COSTATE_SOURCE_DIR "/test/cases/";
constexpr double kPulse = 2.00910255153e-11;

}  // namespace

// All rows had the same error, 3 %, and the methods were said to disagree.
TEST_CASE("check: rows resolve a psi far below absolute tolerances") {
  const WorkingDirectory here;
  const Outcome o = run_costate({"check", kScenes + "pulse_seen.toml", "--json", "--no-files"}, here.path());
  INFO(o.err);
  const Json j = Json::parse(o.out);
  CHECK(j.at("status") == "ok");
  CHECK(j.at("reference").at("psi").get<double>() == Approx(kPulse).epsilon(1e-6));
  CHECK_THAT(j.at("reference").at("note").get<std::string>(), Contains("psi is far below absolute tolerances"));
  int rows = 0;
  for (const Json& row : j.at("rows")) {
    if (!row.contains("psi") || !row.at("psi").is_number()) continue;
    CAPTURE(row.at("formulation"), row.at("method"));
    CHECK(row.at("psi").get<double>() == Approx(kPulse).epsilon(1e-3));
    ++rows;
  }
  CHECK(rows > 20);
}

// It printed eight digits of a psi that was 3 % off.
TEST_CASE("compare: digits of psi are those that are known") {
  const WorkingDirectory here;
  const std::string scene = kScenes + "pulse_seen.toml";
  const Json j = costate_json({"compare", scene, scene, "--no-files"}, here.path());
  CHECK(j.at("a").at("psi").get<double>() == Approx(kPulse).epsilon(1e-4));
  const Json alone = costate_json({"compare", scene, scene, "--no-files", "--no-gradient"}, here.path());
  const double error = std::abs(alone.at("a").at("psi").get<double>() - kPulse);
  CHECK(alone.at("a").at("psi_error").get<double>() >= 0.5 * error);
}

// The work of the last return alone was taken for that of the cycle.
TEST_CASE("cycle: costs on what grows from the section on are refused over several returns") {
  const WorkingDirectory here;
  const std::string scene = kScenes + "worked_disk.toml";
  const Json once = costate_json({"gradient", scene, "--set", "run.cycle=true", "--no-files"}, here.path());
  CHECK(once.at("psi").get<double>() == Approx(0.41460449979).epsilon(1e-7));
  const Json whole = costate_json(
      {"gradient", scene, "--set", "run.cycle=true", "--set", "cycle.period_s=6", "--no-files"}, here.path());
  CHECK(whole.at("psi").get<double>() == Approx(3 * 0.41460449979).epsilon(1e-7));
  for (const char* command : {"gradient", "cycle"}) {
    const Outcome o =
        run_costate({command, scene, "--set", "run.cycle=true", "--set", "cycle.count=3", "--no-files"}, here.path());
    CHECK(o.status == 1);
    CHECK_THAT(o.err, Contains("'couple.drive.work'") && Contains("3 meetings"));
  }
  // A cost that does not hold it may have as many.
  const Json angle = costate_json({"gradient", scene, "--set", "run.cycle=true", "--set", "cycle.count=3", "--set",
                                   "cost.terminal[0].output=\"disk.angle\"", "--no-files"},
                                  here.path());
  CHECK(angle.at("status") == "ok");
  const Outcome late = run_costate({"cycle", scene, "--after", "0.5", "--no-files"}, here.path());
  CHECK(late.status == 1);
  CHECK_THAT(late.err, Contains("run.t_start_s"));
}

TEST_CASE("modes: about a rest of contacts that cannot be") {
  const WorkingDirectory here;
  const Outcome o = run_costate({"modes", kScenes + "sticks_on_slope.toml", "--no-files"}, here.path());
  CHECK_THAT(o.err, Contains("This is no rest of a mechanism with its contacts"));
  // With friction enough it is one.
  const Outcome held = run_costate(
      {"modes", kScenes + "sticks_on_slope.toml", "--set", "contact.f.friction_coefficient=2", "--no-files"},
      here.path());
  CHECK_THAT(held.err, !Contains("no rest"));
}

TEST_CASE("simulate: a CSV of another run does not stay beside the files of this one") {
  const WorkingDirectory here;
  const std::string scene = kScenes + "worked_disk.toml";
  const auto csv = here.path() / "results/worked_disk/trajectory.csv";
  REQUIRE(run_costate({"simulate", scene, "--csv"}, here.path()).status == 0);
  CHECK(std::filesystem::exists(csv));
  REQUIRE(run_costate({"simulate", scene, "--t-end", "1"}, here.path()).status == 0);
  CHECK(!std::filesystem::exists(csv));
}

TEST_CASE("names: a slash would be a step of a path in result files") {
  const WorkingDirectory here;
  const std::string scene = (here.path() / "slash.toml").string();
  write_text(scene, "[point.\"a/b\"]\nx_m = 0\ny_m = 0\n[mass.m]\npoint = \"a/b\"\nmass_kg = 1\n");
  const Outcome o = run_costate({"simulate", scene}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("'a/b' cannot be a name"));
}

// The tolerances that the first evaluation's psi asked for are those of all that follow, also of a run that goes on.
TEST_CASE("optimize: a psi far below absolute tolerances, and a run of it that goes on") {
  const WorkingDirectory here;
  const std::vector<std::string> run = {"optimize", kScenes + "pulse_seen.toml", "--output", "out"};
  const Json whole = costate_json(run, here.path());
  CHECK(whole.at("psi").get<double>() == Approx(1.7724539e-11).epsilon(1e-4));
  CHECK(whole.at("parameters").at("k").get<double>() == Approx(2.9319).epsilon(1e-3));
  CHECK_THAT(whole.at("certificate").at("verdict").get<std::string>(), Contains("strict local minimum"));
  std::string journal = file_text(here / "out/evaluations.jsonl");
  std::size_t end = 0;
  for (int line = 0; line < 5; ++line) end = journal.find('\n', end) + 1;  // a header and four evaluations
  write_text(here / "out/evaluations.jsonl", journal.substr(0, end));
  std::vector<std::string> again = run;
  again.push_back("--resume");
  const Json resumed = costate_json(again, here.path());
  CHECK(resumed.at("psi") == whole.at("psi"));
  CHECK(resumed.at("evaluations").size() == whole.at("evaluations").size());
  CHECK(resumed.at("certificate").at("verdict") == whole.at("certificate").at("verdict"));
}

// What ends a run by the penalty's soft contact is what that gives: 0.08 s, said to seven digits, where a mass on the
// ground, at rest at the level, is lifted off it at m g/k = 0.981 s. (Firmer constraints do not tell: what they give
// settles in the same time.) A box that tips at m g b/(k h) = 1.4715 s has risen by 0.1 mm at 1.527187 s.
TEST_CASE("ends of runs by soft constraints say how well they are known") {
  const WorkingDirectory here;
  for (std::vector<std::string> by : {std::vector<std::string>{"simulate"},
                                      {"gradient", "--method", "discrete-adjoint"},
                                      {"gradient", "--method", "idas-adjoint"}}) {
    by.insert(by.end(), {"--formulation", "penalty", "--no-files", kScenes + "soft_end.toml"});
    CAPTURE(by);
    const Outcome o = run_costate(by, here.path());
    CHECK(o.status == 1);
    CHECK_THAT(o.err, Contains("with exact constraints; the end at t = 0.0"));
    by.back() = kScenes + "soft_tip.toml";
    const auto told = [&] {
      const Json j = costate_json(by, here.path());
      const double error = std::abs(j.at("psi").get<double>() - 1.527187), known = j.at("psi_error").get<double>();
      CHECK(known > 0.9 * (error - 2e-6));  // of the number above
      CHECK(known < 2 * error + 1e-5);
      return j.at("warnings").dump();
    };
    told();
    by.insert(by.end(), {"--penalty-alpha", "1e4"});
    CHECK_THAT(told(), Contains("With exact constraints the run ends at 1.52719 s, and not at 1.5289"));
  }
}

// IDAS could not begin anew over nothing but rounding; and of which side a derivative is was not said.
TEST_CASE("samples in the instant of an impact: derivatives are those of one side") {
  const WorkingDirectory here;
  for (const char* formulation : {"baumgarte", "index2", "maggi"})
    for (const char* method : {"idas-adjoint", "idas-forward", "cvodes-adjoint", "cvodes-forward"}) {
      const bool residual = std::string(formulation) != "maggi", explicit_form = std::string(formulation) != "index2";
      if (!(method[0] == 'i' ? residual : explicit_form)) continue;
      CAPTURE(formulation, method);
      const Json j = costate_json({"gradient", kScenes + "sample_at_impact.toml", "--formulation", formulation,
                                   "--method", method, "--no-files"},
                                  here.path());
      CHECK(j.at("psi").get<double>() == Approx(0.09).epsilon(1e-6));
      CHECK_THAT(j.at("warnings").dump(), Contains("where a sample of the cost is"));
      // 2 (y - 0.3) dy/dh, with dy/dh = 1 before, and -e behind.
      const double by_height = j.at("gradient").at("h").get<double>();
      CHECK((std::abs(by_height + 0.6) < 1e-4 || std::abs(by_height - 0.3) < 1e-4));
    }
}

// The touch of compliant contact is smooth: nothing is said of it, and adjoints get over it as near as samples come.
TEST_CASE("samples in the instant of a smooth touch") {
  const WorkingDirectory here;
  const std::string scene = file_text(kScenes + "sample_at_touch.toml"), at = "[0.2, 0.003]";
  for (const char* t : {"0.2", "0.2000000000000001", "0.199999999999999", "0.200000000000001"})
    for (const char* method : {"idas-adjoint", "cvodes-adjoint", "idas-forward"}) {
      CAPTURE(t, method);
      std::string moved = scene;
      moved.replace(moved.find(at), at.size(), std::string("[") + t + ", 0.003]");
      write_text(here.path() / "scene.toml", moved);
      const Json j = costate_json({"gradient", "scene.toml", "--method", method, "--no-files"}, here.path());
      // As maggi by cvodes-adjoint and differences have it.
      CHECK(j.at("gradient").at("point.P.y_m").get<double>() == Approx(704.4248).epsilon(1e-6));
      CHECK(j.at("gradient").at("contact.c.restitution").get<double>() == Approx(177.06754).epsilon(1e-6));
      CHECK(j.at("warnings").dump().find("where a sample of the cost is") == std::string::npos);
    }
}

// An impact that rounding puts behind the end was not told, and psi, of velocities, jumps with it.
TEST_CASE("runs that end as something strikes say so, on whichever side it is found") {
  const WorkingDirectory here;
  for (const char* end : {"1", "0.99999999999", "1.00000000001"})
    for (const char* formulation : {"index1", "baumgarte", "maggi"}) {
      CAPTURE(end, formulation);
      const Json j = costate_json(
          {"simulate", kScenes + "ends_at_impact.toml", "--formulation", formulation, "--t-end", end, "--no-files"},
          here.path());
      CHECK_THAT(j.at("warnings").dump(), Contains("rounding decides whether it belongs to the run"));
    }
  const Json before =
      costate_json({"simulate", kScenes + "ends_at_impact.toml", "--t-end", "0.99999", "--no-files"}, here.path());
  CHECK(before.at("warnings").empty());
}

// A gradient that is confirmed may be that of a tenth of the tolerance: its end is that run's, too.
TEST_CASE("ends of runs are told of the run that psi is of") {
  const WorkingDirectory here;
  const std::vector<std::string> run = {
      "gradient", kScenes + "soft_tip.toml", "--formulation", "penalty", "--method", "idas-adjoint", "--no-files"};
  const auto by = [&](std::vector<std::string> more) {
    more.insert(more.begin(), run.begin(), run.end());
    return costate_json(more, here.path());
  };
  const Json confirmed = by({}), at = by({"--no-confirm"}), tenth = by({"--no-confirm", "--rtol", "1e-9"});
  REQUIRE(confirmed.at("psi") == tenth.at("psi"));
  CHECK(confirmed.at("end").at("t") == tenth.at("end").at("t"));
  CHECK(confirmed.at("end").at("t") != at.at("end").at("t"));
}
