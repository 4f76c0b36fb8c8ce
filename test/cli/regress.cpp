// costate regress: what moved is named with the amount, --update writes it, mistakes in baselines are
// reported as mistakes in scenes are, and a failing case does not keep the others from running.
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <filesystem>

#include "five_bar.h"
#include "process.h"

using Catch::Matchers::Contains;
using costate::test::Connection;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::kFiveBar;
using costate::test::one_object;
using costate::test::Outcome;
using costate::test::Process;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace fs = std::filesystem;

namespace {

Json minimal(const std::string& command, const Json& options = Json::object()) {
  Json b = {{"scene", kFiveBar}, {"command", command}};
  if (!options.empty()) b["options"] = options;
  return b;
}

void put(const WorkingDirectory& here, const std::string& name, const Json& baseline) {
  fs::create_directories((here / name).parent_path());
  write_text(here / name, baseline.dump(1));
}

Json read(const WorkingDirectory& here, const std::string& name) { return Json::parse(file_text(here / name)); }

const Json& quantity(const Json& result, const std::string& name, std::size_t index = 0) {
  for (const Json& q : result.at("cases").at(index).at("quantities"))
    if (q.at("name") == name) return q;
  FAIL("no quantity " << name);
  return result;
}

/// The message about a baseline with this text.
std::string mistake_in_text(const std::string& text) {
  const WorkingDirectory here;
  write_text(here / "case.json", text);
  for (const std::string option : {"--quiet", "--update"}) {
    const Outcome o = run_costate({"regress", ".", option}, here.path());
    CHECK(o.status == 1);
    CHECK_THAT(o.err, Contains("case.json"));
    CHECK(file_text(here / "case.json") == text);
    if (option == "--update") return o.err;
  }
  return {};
}

std::string mistake(const Json& baseline) { return mistake_in_text(baseline.dump()); }

}  // namespace

TEST_CASE("regress: a minimal file is filled in by --update and holds from then on") {
  const WorkingDirectory here;
  put(here, "base/gradient.json", minimal("gradient", {{"formulation", "baumgarte"}, {"method", "cvodes-adjoint"}}));
  put(here, "base/deep/motion.json", minimal("simulate", {{"t-end", 1}, {"set", {"run.rtol=1e-9"}}}));
  put(here, "base/optimum.json", minimal("optimize"));
  const Outcome before = run_costate({"regress", "base"}, here.path());
  CHECK(before.status == 1);
  CHECK_THAT(before.err, Contains("gradient.json") && Contains("--update"));

  const Outcome update = run_costate({"regress", "base", "--update"}, here.path());
  CHECK(update.status == 0);
  CHECK_THAT(update.out, Contains("deep/motion") && Contains("psi: ") && Contains("3 updated"));
  const Json gradient = read(here, "base/gradient.json");
  CHECK(gradient.at("options") == Json({{"formulation", "baumgarte"}, {"method", "cvodes-adjoint"}}));
  const Json& q = gradient.at("quantities");
  for (const std::string name : {"L01", "L02"})
    CHECK(q.at("gradient." + name).at("value").get<double>() ==
          Approx(costate::test::kGradient.at(name)).epsilon(1e-5));
  CHECK(q.at("counters.backward_steps").at("value").is_number_integer());
  CHECK(q.at("psi").at("relative") == 1e-5);  // 1000 times the scene's rtol
  for (const auto& [name, entry] : q.items()) {
    INFO(name);
    CHECK((entry.contains("relative") || entry.contains("absolute")));
    CHECK(entry.at("reason").get<std::string>().size() > 10);
  }
  const Json motion = read(here, "base/deep/motion.json").at("quantities");
  CHECK(motion.at("terminal.P2.x").at("value").get<double>() == Approx(0.18620239048995613).epsilon(1e-6));
  CHECK(motion.contains("terminal.P2.y_dot"));
  CHECK(motion.at("terminal.P2.x").at("relative") == 1e-6);  // the override's rtol counts
  const Json optimum = read(here, "base/optimum.json").at("quantities");
  CHECK(optimum.at("parameters.L01").at("value").get<double>() == Approx(costate::test::kOptimalL01).epsilon(1e-4));
  CHECK(optimum.at("evaluations").at("value") == 8);

  const auto entries = here.entries();
  const Json again = costate_json({"regress", "base"}, here.path());
  CHECK(again.at("status") == "ok");
  REQUIRE(again.at("cases").size() == 3);
  CHECK(again.at("cases").at(0).at("name") == "deep/motion");
  CHECK(here.entries() == entries);  // no results, no temporaries
  // What has not moved is not written again, by --update neither.
  const std::string text = file_text(here / "base/gradient.json");
  CHECK(run_costate({"regress", "base", "--update"}, here.path()).status == 0);
  CHECK(file_text(here / "base/gradient.json") == text);
}

TEST_CASE("regress: the smallest numbers are filled in as well") {
  const WorkingDirectory here;
  const Json weights = {"cost.running[0].weight=1e-306", "cost.running[1].weight=1e-306"};
  put(here, "tiny.json",
      minimal("gradient",
              {{"t-end", 0.1}, {"formulation", "baumgarte"}, {"method", "cvodes-forward"}, {"set", weights}}));
  const Outcome update = run_costate({"regress", "tiny.json", "--update"}, here.path());
  INFO(update.err);
  CHECK(update.status == 0);
  const double psi = read(here, "tiny.json").at("quantities").at("psi").at("value");
  CHECK(psi > 0);
  CHECK(psi < 1e-306);
}

TEST_CASE("regress: --set asks what other values would move, over those of the baseline") {
  const WorkingDirectory here;
  put(here, "b.json", minimal("simulate", {{"t-end", 0.5}, {"set", {"bar.A1.mass_kg=1.2"}}}));
  REQUIRE(run_costate({"regress", ".", "--update"}, here.path()).status == 0);
  const std::string text = file_text(here / "b.json");
  CHECK(run_costate({"regress", ".", "--set", "bar.A1.mass_kg=1.2"}, here.path()).status == 0);
  const Json j = costate_json({"regress", ".", "--set", "bar.A1.mass_kg=2"}, here.path(), 1);
  CHECK(j.at("status") == "moved");
  // As the command by itself has it.
  const Json alone =
      costate_json({"simulate", kFiveBar, "--t-end", "0.5", "--set", "bar.A1.mass_kg=2", "--no-files"}, here.path());
  CHECK(quantity(j, "psi").at("found") == alone.at("psi"));
  const Outcome wrong = run_costate({"regress", ".", "--set", "bar.A9.mass_kg=2"}, here.path());
  CHECK(wrong.status == 1);
  CHECK_THAT(wrong.err, Contains("b.json") && Contains("A9"));
  CHECK_THAT(run_costate({"regress", ".", "--set", "bar.A1.mass_kg=2", "--update"}, here.path()).err,
             Contains("excludes --update"));
  CHECK(file_text(here / "b.json") == text);
}

TEST_CASE("regress: what moved is named with the amount, --update keeps tolerance and reason") {
  const WorkingDirectory here;
  Json b = minimal("gradient");
  b["quantities"] = {
      {"psi", {{"value", costate::test::kPsi + 1e-3}, {"absolute", 1e-4}, {"reason", "my own reason"}}},
      {"gradient.L01", {{"value", costate::test::kGradient.at("L01")}, {"relative", 1e-5}, {"reason", "rtol"}}},
      {"counters.steps", {{"value", 1}, {"relative", 1e6}, {"reason", "any number"}}}};
  put(here, "base/case.json", b);
  const Outcome o = run_costate({"regress", "base"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.out, Contains("MOVED    case") && Contains("psi: 0.72787") && Contains("by -1.00e-03") &&
                        Contains("allowed 1.0e-04") && Contains("my own reason") && Contains("1 moved") &&
                        Contains("--update") && !Contains("gradient.L01:"));
  CHECK_THAT(o.err, Contains("moved: case: psi"));
  const Json j = costate_json({"regress", "base"}, here.path(), 1);
  CHECK(j.at("status") == "moved");
  CHECK(j.at("cases").at(0).at("status") == "moved");
  CHECK(quantity(j, "psi").at("moved") == true);
  CHECK(quantity(j, "psi").at("difference").get<double>() == Approx(-1e-3).epsilon(1e-3));
  CHECK(quantity(j, "psi").at("allowed") == 1e-4);
  CHECK(quantity(j, "psi").at("reason") == "my own reason");
  CHECK(quantity(j, "gradient.L01").at("moved") == false);
  CHECK(read(here, "base/case.json") == b);

  const Outcome update = run_costate({"regress", "base", "--update"}, here.path());
  CHECK(update.status == 0);
  CHECK_THAT(update.out, Contains("updated  case") && Contains("psi: 0.72787") && Contains("-> 0.72687"));
  const Json after = read(here, "base/case.json");
  CHECK(after.at("quantities").at("psi").at("value").get<double>() == Approx(costate::test::kPsi).epsilon(1e-6));
  CHECK(after.at("quantities").at("psi").at("absolute") == 1e-4);
  CHECK(after.at("quantities").at("psi").at("reason") == "my own reason");
  CHECK(after.at("quantities").at("gradient.L01") == b.at("quantities").at("gradient.L01"));
  CHECK(run_costate({"regress", "base/case.json"}, here.path()).status == 0);
}

TEST_CASE("regress: a quantity without a value is filled in, whatever it is") {
  const WorkingDirectory here;
  Json b = minimal("simulate");
  b["quantities"] = {{"terminal.energy.total", Json::object()},
                     {"terminal.P2.x_ddot", {{"absolute", 0.5}, {"reason", "mine"}}}};
  put(here, "case.json", b);
  CHECK_THAT(run_costate({"regress", "."}, here.path()).err, Contains("no value yet"));
  CHECK(run_costate({"regress", ".", "--update"}, here.path()).status == 0);
  const Json q = read(here, "case.json").at("quantities");
  CHECK(q.size() == 2);
  CHECK(q.at("terminal.energy.total").contains("relative"));
  CHECK(q.at("terminal.P2.x_ddot").at("absolute") == 0.5);
  CHECK(q.at("terminal.P2.x_ddot").at("value").is_number());
}

TEST_CASE("regress: mistakes in a baseline name the file, the key and what was expected") {
  CHECK_THAT(mistake_in_text("{\"scene\": \"x.toml\",\n \"command\": }"),
             Contains("case.json:2:13: ") && Contains("JSON"));
  CHECK_THAT(mistake_in_text("{\"scene\": \"a\", \"scene\": \"b\"}"), Contains("scene") && Contains("twice"));
  CHECK_THAT(mistake_in_text("[]"), Contains("object") && Contains("array"));
  CHECK_THAT(mistake_in_text("{\"value\": 1e3300}"), Contains("case.json: ") && Contains("beyond 1.8e308"));
  CHECK_THAT(mistake(Json{{"command", "gradient"}}), Contains("scene: ") && Contains("missing"));
  CHECK_THAT(mistake(Json{{"scene", kFiveBar}}), Contains("command: ") && Contains("gradient"));
  CHECK_THAT(mistake(Json{{"scene", 3}, {"command", "gradient"}}), Contains("scene: Expected text") && Contains("3"));
  CHECK_THAT(mistake(minimal("gradeint")), Contains("command: ") && Contains("Did you mean 'gradient'?"));
  CHECK_THAT(mistake(minimal("gradient", {{"mehtod", "idas-adjoint"}})),
             Contains("options.mehtod") && Contains("Did you mean 'method'?"));
  CHECK_THAT(mistake(minimal("gradient", {{"output", "x"}})), Contains("options.output"));
  CHECK_THAT(mistake(minimal("gradient", {{"rtol", "small"}})), Contains("options") && Contains("--rtol"));
  CHECK_THAT(mistake(minimal("gradient", {{"rtol", {{"a", 1}}}})), Contains("options.rtol: Expected"));
  CHECK_THAT(mistake(minimal("gradient", {{"formulation", "indx1"}})), Contains("Did you mean 'index1'?"));
  Json b = minimal("gradient");
  b["quantites"] = Json::object();
  CHECK_THAT(mistake(b), Contains("Did you mean 'quantities'?"));
  const auto with = [](const Json& entry) {
    Json c = minimal("gradient");
    c["quantities"] = {{"psi", entry}};
    return c;
  };
  CHECK_THAT(mistake(with(0.7)), Contains("quantities.psi: Expected an object") && Contains("0.7"));
  CHECK_THAT(mistake(with({{"value", "x"}})), Contains("quantities.psi.value: Expected a number"));
  CHECK_THAT(mistake(with({{"value", 1}})), Contains("quantities.psi") && Contains("tolerance"));
  CHECK_THAT(mistake(with({{"value", 1}, {"relative", 1e-3}})), Contains("quantities.psi.reason") && Contains("why"));
  CHECK_THAT(mistake(with({{"value", 1}, {"relative", -1}, {"reason", "r"}})), Contains("quantities.psi.relative"));
  CHECK_THAT(mistake(with({{"value", 1}, {"tolerance", 1}})), Contains("quantities.psi.tolerance"));
  Json unknown = minimal("gradient");
  unknown["quantities"] = {{"gradient.L03", {{"value", 1}, {"absolute", 1}, {"reason", "r"}}}};
  CHECK_THAT(mistake(unknown), Contains("quantities.gradient.L03") && Contains("Did you mean 'gradient.L0"));
}

TEST_CASE("regress: cases that fail do not keep the others from running") {
  const WorkingDirectory here;
  put(here, "a_missing.json", Json{{"scene", "nowhere/scene.toml"}, {"command", "simulate"}});
  put(here, "b_fails.json", minimal("simulate", {{"set", {"gravity.y_m_per_s2=-1e300"}}}));
  write_text(here / "c_malformed.json", "{");
  put(here, "d_good.json", minimal("gradient"));
  REQUIRE(run_costate({"regress", ".", "--only", "d_*", "--update"}, here.path()).status == 0);
  const Outcome o = run_costate({"regress", "."}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("nowhere/scene.toml") && Contains("b_fails.json") && Contains("t =") &&
                        Contains("c_malformed.json:1:"));
  CHECK_THAT(o.out, Contains("FAILED   a_missing") && Contains("ok       d_good") &&
                        Contains("4 baselines: 0 moved, 3 failed"));
  const Outcome quiet = run_costate({"regress", ".", "--json"}, here.path());
  const Json j = one_object(quiet.out);
  CHECK(quiet.status == 1);
  CHECK(j.at("status") == "failed");
  CHECK(j.at("failed") == 3);
  CHECK(j.at("cases").at(0).at("status") == "failed");
  CHECK_THAT(j.at("cases").at(0).at("error").get<std::string>(), Contains("nowhere/scene.toml"));
  CHECK(j.at("cases").at(3).at("status") == "ok");
}

TEST_CASE("regress: --only, by name and pattern") {
  const WorkingDirectory here;
  for (const std::string name : {"one.json", "two.json", "sub/one.json"}) put(here, name, minimal("simulate"));
  REQUIRE(run_costate({"regress", ".", "--update"}, here.path()).status == 0);
  const auto count = [&](const std::vector<std::string>& only) {
    std::vector<std::string> arguments = {"regress", "."};
    for (const auto& o : only) arguments.insert(arguments.end(), {"--only", o});
    return costate_json(arguments, here.path()).at("cases").size();
  };
  CHECK(count({}) == 3);
  CHECK(count({"one"}) == 1);
  CHECK(count({"*one"}) == 2);
  CHECK(count({"one", "two"}) == 2);
  const Json none = costate_json({"regress", ".", "--only", "tow"}, here.path(), 1);
  CHECK(none.at("status") == "failed");
  CHECK_THAT(none.at("error").get<std::string>(), Contains("--only") && Contains("'tow'") && Contains("'two'"));
}

TEST_CASE("regress: a directory without baselines, or none, says how to make one") {
  const WorkingDirectory here;
  fs::create_directory(here / "empty");
  for (const std::string directory : {"empty", "nowhere"}) {
    const Outcome o = run_costate({"regress", directory}, here.path());
    CHECK(o.status == 1);
    CHECK_THAT(o.err, Contains(directory) && Contains("\"scene\"") && Contains("\"command\"") && Contains("--update"));
  }
  CHECK(run_costate({"regress"}, here.path()).status == 2);
  CHECK_THAT(run_costate({"regress", "--help"}, here.path()).out, Contains("--update") && Contains("baseline"));
}

TEST_CASE("regress: a baseline that cannot be written fails and stays as it was") {
  const WorkingDirectory here;
  put(here, "case.json", minimal("simulate"));
  const std::string text = file_text(here / "case.json");
  fs::permissions(here.path(), fs::perms::owner_read | fs::perms::owner_exec);
  const Outcome o = run_costate({"regress", ".", "--update"}, here.path());
  fs::permissions(here.path(), fs::perms::owner_all);
  if (o.status == 0) return;  // the superuser writes anywhere
  CHECK_THAT(o.err, Contains("case.json"));
  CHECK(file_text(here / "case.json") == text);
}

TEST_CASE("regress: Ctrl-C keeps what is done and says so") {
  const WorkingDirectory here;
  put(here, "a.json", minimal("simulate"));
  put(here, "b.json", minimal("simulate", {{"t-end", 1e5}}));
  put(here, "c.json", minimal("simulate"));
  for (const bool json : {false, true}) {
    put(here, "a.json", minimal("simulate"));
    std::vector<std::string> arguments = {"regress", ".", "--update"};
    if (json) arguments.push_back("--json");
    Process process(COSTATE_EXECUTABLE, arguments, here.path());
    REQUIRE(process.wait_until([&] { return file_text(here / "a.json").find("reason") != std::string::npos; }));
    process.send(SIGINT);
    const Outcome o = process.finish();
    CHECK(o.status == 130);
    CHECK_THAT(o.err, Contains("interrupted") && Contains("1 of 3 baselines"));
    CHECK(read(here, "a.json").contains("quantities"));
    CHECK(!read(here, "b.json").contains("quantities"));
    if (json) {
      const Json j = one_object(o.out);
      CHECK(j.at("status") == "interrupted");
      CHECK(j.at("cases").size() == 1);
    } else {
      CHECK_THAT(o.out, Contains("updated  a"));
    }
  }
}

TEST_CASE("regress: progress on a terminal only") {
  const WorkingDirectory here;
  put(here, "a.json", minimal("simulate", {{"t-end", 100}}));
  const Outcome o = run_costate({"regress", ".", "--update"}, here.path(), Connection::terminal_errors);
  CHECK(o.status == 0);
  CHECK_THAT(o.terminal, Contains("\rt = "));
  CHECK_THAT(o.out, !Contains("\r") && Contains("updated  a"));
  CHECK(run_costate({"regress", "."}, here.path()).err.empty());
}
