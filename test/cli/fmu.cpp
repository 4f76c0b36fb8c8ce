// costate export: FMUs, run by an importer of the tests' own (programs/fmu_importer.cpp) both ways, against costate
// simulate; their derivatives against each other and against central differences.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "five_bar.h"
#include "process.h"
#include "property/driven_carriage.h"
#include "support/markup.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kModelsForFmu = COSTATE_MODELS_DIR;

/// The FMU of a scene, imported: fixed steps of the importer, and values for parameters.
Json imported(const WorkingDirectory& here, const std::string& scene, const std::vector<std::string>& options,
              int steps, const std::vector<std::string>& values = {}) {
  std::vector<std::string> command = {"export", scene, "-o", "scene.fmu"};
  command.insert(command.end(), options.begin(), options.end());
  const Outcome o = run_costate(command, here.path());
  INFO(o.err);
  REQUIRE(o.status == 0);
  std::vector<std::string> arguments = {"scene.fmu", "unpacked", std::to_string(steps)};
  arguments.insert(arguments.end(), values.begin(), values.end());
  const Outcome i = Process(COSTATE_FMU_IMPORTER, arguments, here.path()).finish();
  INFO(i.err);
  REQUIRE(i.status == 0);
  const Json j = Json::parse(i.out);
  CHECK(j.at("version") == "3.0");
  CHECK(j.at("from_elsewhere") == Json::array());
  return j;
}

/// Where `costate simulate` ends with the same settings, by CVODES, on which co-simulation runs.
Json ended(const WorkingDirectory& here, const std::string& scene, std::vector<std::string> options) {
  options.insert(options.begin(), {"simulate", scene, "--no-files", "--integrator", "cvodes"});
  return costate_json(options, here.path()).at("terminal");
}

/// The importer's Runge-Kutta method of fixed steps: what halving the steps changes bounds the error that is left.
/// CVODES at 1e-11, stopped at other times, keeps 1e-7 of these motions, which enlarge an error some thousand times.
void check_motion(const Json& j, const Json& expected) {
  REQUIRE(!j.at("simulated").empty());
  for (const auto& [name, value] : j.at("simulated").items()) {
    INFO(name);
    const double reference = expected.at(name), room = 1e-7 * std::max(1.0, std::abs(reference));
    CHECK(std::abs(value.get<double>() - reference) <= room);
    if (!j.contains("exchanged")) continue;
    const double fine = j.at("exchanged").at(name), coarse = j.at("exchanged_coarse").at(name);
    CHECK(std::abs(fine - coarse) <= 1e-3 * std::max(1.0, std::abs(reference)));
    CHECK(std::abs(fine - reference) <= std::abs(fine - coarse) + room);
  }
}

/// v^T (J u) = (v^T J) u to rounding, which equations of condition 1e4 enlarge; J u against central differences with
/// steps of 1e-5, whose error is that squared times third derivatives, and 1e-16/1e-5 of rounding.
void check_products(const Json& j, const std::string& which) {
  INFO(which << ": " << j.at(which));
  const Json& p = j.at(which);
  CHECK(std::abs(p.at("forward").get<double>() - p.at("backward").get<double>()) <=
        1e-11 * p.at("scale").get<double>());
  CHECK(p.at("off").get<double>() < 1e-7);
}

}  // namespace

TEST_CASE("export: an FMU moves as the scene does, both ways, with exact derivatives") {
  const std::vector<std::string> exact = {"--set", "run.rtol=1e-11"};
  for (const char* scene : {"five_bar/five_bar", "slider_crank/slider_crank"}) {
    INFO(scene);
    const WorkingDirectory here;
    const std::string path = kModelsForFmu + "/" + scene + ".toml";
    const Json j = imported(here, path, exact, 4000);
    CHECK(j.at("exchange") == true);
    check_motion(j, ended(here, path, exact));
    for (const char* which : {"by_states", "by_both", "of_start"}) check_products(j, which);
    CHECK(j.at("by_time") == 3);  // an error
    CHECK_THAT(j.at("said").dump(), Contains("There is no derivative by 'time'"));
  }
}

TEST_CASE("export: parameters set before the start are those of the motion") {
  const WorkingDirectory here;
  const std::vector<std::string> exact = {"--set", "run.rtol=1e-11"};
  const Json j = imported(here, kFiveBar, exact, 4000, {"L01=2.4", "m2=1.2"});
  std::vector<std::string> changed = exact;
  changed.insert(changed.end(), {"--set", "spring.S1.natural_length_m=2.4", "--set", "bar.B12.mass_kg=1.2"});
  check_motion(j, ended(here, kFiveBar, changed));
}

TEST_CASE("export: velocities that jump at a driver's kink are events at known times") {
  const WorkingDirectory here;
  write_text(
      here / "driven.toml",
      driven_carriage(R"({ kind = "bump", height_m = 0.15, start_m = 0.3, length_m = 0.5, shape = "half_sine" })"));
  const std::vector<std::string> exact = {"--set", "run.rtol=1e-11"};
  const Json j = imported(here, "driven.toml", exact, 2400);
  CHECK(j.at("jumps") == 2);
  check_motion(j, ended(here, "driven.toml", exact));
  check_products(j, "by_states");
}

TEST_CASE("export: contacts that close are there in co-simulation alone, and the FMU says so") {
  const WorkingDirectory here;
  const std::string scene = kModelsForFmu + "/bouncing_ball/bouncing_ball.toml";
  const std::vector<std::string> exact = {"--set", "run.rtol=1e-11"};
  const Json j = imported(here, scene, exact, 100);
  CHECK(j.at("exchange") == false);
  check_motion(j, ended(here, scene, exact));
  const std::string xml = file_text(here / "unpacked/modelDescription.xml");
  CHECK_THAT(xml, !Contains("ModelExchange") && !Contains("providesAdjointDerivatives"));
  const Json summary = costate_json({"export", scene, "-o", "b.fmu"}, here.path());
  CHECK(summary.at("model_exchange") == false);
  CHECK(summary.at("derivatives") == false);
}

TEST_CASE("export: in co-simulation contacts are as the run has them, in the states' derivatives, too") {
  const WorkingDirectory here;
  // A ball that slides from the start, mu g, and rolls in the end.
  const std::string scene = kModelsForFmu + "/bouncing_ball/thrown.toml";
  const Json j = imported(here, scene, {}, 0), end = ended(here, scene, {});
  CHECK(j.at("rates_first").at("der(ball.x_dot)").get<double>() == Approx(-0.2 * 9.81));
  CHECK(std::abs(j.at("rates_first").at("der(ball.y_dot)").get<double>()) < 1e-10);
  for (const std::string name : {"ball.x", "ball.y", "ball.angle"}) {
    INFO(name);
    // Of the equations at the same state within 1e2 rtol; that of a contact in another mode is some 2 m/s^2 off.
    CHECK(j.at("rates").at("der(" + name + "_dot)").get<double>() ==
          Approx(end.at(name + "_ddot").get<double>()).margin(1e-8));
  }
}

TEST_CASE("export: in co-simulation a stiff scene goes on by BDF") {
  const WorkingDirectory here;
  const std::string scene = kModelsForFmu + "/damped_pendulum/damped_pendulum.toml";
  std::vector<std::string> stiff;
  for (const char* changed : {"spring.strut.stiffness_N_per_m=2000", "spring.strut.damping_N_s_per_m=3e6",
                              "parameter.c.upper=1e7", "run.t_end_s=5000", "run.outputs=['P.x']"})
    stiff.insert(stiff.end(), {"--set", changed});
  // Steps of Adams' method would be bound by stability all the way.
  std::vector<std::string> command = {"simulate", scene, "--no-files", "--integrator", "cvodes"};
  command.insert(command.end(), stiff.begin(), stiff.end());
  REQUIRE_THAT(run_costate(command, here.path()).err, Contains("The motion is stiff"));
  stiff.insert(stiff.end(), {"--set", "run.rtol=1e-10"});
  check_motion(imported(here, scene, stiff, 0), ended(here, scene, stiff));
}

TEST_CASE("export: files that the scene names go with it") {
  const WorkingDirectory here;
  const std::string cases = std::string(COSTATE_SOURCE_DIR) + "/test/cases/";
  write_text(here / "scene.toml", file_text(cases + "road_file.toml"));
  write_text(here / "road.txt", file_text(cases + "road.txt"));
  const Json expected = ended(here, "scene.toml", {"--set", "run.rtol=1e-11"});
  const Outcome o = run_costate({"export", "scene.toml", "-o", "scene.fmu", "--set", "run.rtol=1e-11"}, here.path());
  REQUIRE(o.status == 0);
  CHECK(o.err.empty());
  std::filesystem::remove(here / "road.txt");
  const Outcome i = Process(COSTATE_FMU_IMPORTER, {"scene.fmu", "unpacked", "2000"}, here.path()).finish();
  INFO(i.err);
  REQUIRE(i.status == 0);
  check_motion(Json::parse(i.out), expected);
  CHECK_THAT(file_text(here / "unpacked/resources/scene.toml"), !Contains(here.path().string()));
}

TEST_CASE("export: the description is well-formed, and lists what is there") {
  const WorkingDirectory here;
  write_text(here / "s.toml", file_text(kFiveBar));
  const Json j = costate_json({"export", "s.toml", "-o", "1 <b>.fmu", "--set", R"(title="<b>1 & 2</b>")"}, here.path());
  CHECK(j.at("states") == 12);
  CHECK(j.at("parameters") == 8);
  CHECK(j.at("file") == "1 <b>.fmu");
  const Outcome i = Process(COSTATE_FMU_IMPORTER, {"1 <b>.fmu", "unpacked", "50"}, here.path()).finish();
  INFO(i.err);
  REQUIRE(i.status == 0);
  std::string xml = file_text(here / "unpacked/modelDescription.xml");
  CHECK_THAT(xml,
             Contains("modelName=\"&lt;b&gt;1 &amp; 2&lt;/b&gt;\"") && Contains("modelIdentifier=\"scene_1__b_\""));
  xml.erase(0, xml.find("?>") + 3);
  CHECK(xml_fault(xml).empty());
  CHECK(all_between(xml, "<ContinuousStateDerivative ", "/>").size() == 12);
  CHECK(all_between(xml, "causality=\"parameter\"", "/>").size() == 8);
  CHECK(all_between(xml, "<Output ", "/>").size() == j.at("outputs"));
  // Units are SI's, of parameters and of rates, too; each that is named is defined.
  CHECK_THAT(xml, Contains("<Unit name=\"N/m\"><BaseUnit kg=\"1\" s=\"-2\"/></Unit>") &&
                      Contains("<Unit name=\"m/s^2\"><BaseUnit m=\"1\" s=\"-2\"/></Unit>"));
  for (const auto& [name, unit] : {std::pair{"parameter.k1", "N/m"},
                                   {"parameter.m1", "kg"},
                                   {"parameter.L01", "m"},
                                   {"der(P1.x)", "m/s"},
                                   {"der(P1.x_dot)", "m/s^2"}}) {
    const auto at = all_between(xml, "<Float64 name=\"" + std::string(name) + "\"", "/>");
    INFO(name);
    REQUIRE(at.size() == 1);
    CHECK_THAT(at[0], Contains(" unit=\"" + std::string(unit) + "\""));
  }
  for (const std::string& unit : all_between(xml, " unit=\"", "\"")) {
    INFO(unit);
    CHECK_THAT(xml, Contains("<Unit name=\"" + unit + "\">"));
  }
  // The same scene gives the same bytes.
  const std::string first = file_text(here / "1 <b>.fmu");
  costate_json({"export", "s.toml", "-o", "1 <b>.fmu", "--set", R"(title="<b>1 & 2</b>")"}, here.path());
  CHECK((file_text(here / "1 <b>.fmu") == first));
}

TEST_CASE("export: what is wrong is refused with a sentence") {
  const WorkingDirectory here;
  const Outcome kind = run_costate({"export", kFiveBar, "-o", "scene.zip"}, here.path());
  CHECK(kind.status == 1);
  CHECK_THAT(kind.err, Contains("ends in .fmu, found 'scene.zip'"));
  const Outcome maggi = run_costate({"export", kFiveBar, "-o", "m.fmu", "--formulation", "maggi"}, here.path());
  CHECK(maggi.status == 1);
  CHECK_THAT(maggi.err, Contains("maggi") && Contains("--formulation"));
  // A bar that cannot reach: at its place in the scene.
  const Outcome apart = run_costate({"export", kFiveBar, "-o", "a.fmu", "--set", "bar.B12.length_m=9"}, here.path());
  CHECK(apart.status == 1);
  CHECK_THAT(apart.err, Contains("five_bar.toml:"));
  CHECK(here.entries().empty());
  // A scene's own formulation without an explicit form is replaced, and that is said.
  const Json j = costate_json({"export", kFiveBar, "-o", "i.fmu", "--set", "run.formulation=index3"}, here.path());
  CHECK(j.at("formulation") == "baumgarte");
  CHECK_THAT(j.at("warnings").dump(), Contains("index3"));
  const Json refused = imported(here, kFiveBar, {}, 50).at("refused");
  const char* expected[] = {"do not belong together",
                            "no variable with value reference 100000",
                            "known from fmi3EnterInitializationMode on",
                            "does not allow it",
                            "cannot be set now",
                            "found a step from",
                            "later stop time"};
  REQUIRE(refused.size() == std::size(expected));
  for (std::size_t i = 0; i < std::size(expected); ++i)
    CHECK_THAT(refused[i].get<std::string>(), Contains(expected[i]));
}
