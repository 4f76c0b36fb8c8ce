// What people meet in their first hours: options that mean the same everywhere, choices that complete themselves,
// messages that name the cause.
#include <catch2/catch.hpp>

#include "costate/formulation/formulation.h"
#include "five_bar.h"
#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kModels = COSTATE_MODELS_DIR;

const std::string kHanging = R"([gravity]
z_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0
z_m = 0

[rigid_body.arm]
x_m = 0.5
y_m = 0
z_m = 0
mass_kg = 1
inertia_xx_kg_m2 = 0.01
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1

[point.end]
on = "arm"
x_m = -0.5
y_m = 0
z_m = 0

[hinge.shoulder]
points = ["A", "end"]
axis_first = [0, 1, 0]
angle = "shoulder"

[start]
given = ["shoulder.angle"]

[run]
t_end_s = 0.1
)";

}  // namespace

TEST_CASE("newcomers: --no-files, --quiet and --set are options of every command that reads a scene") {
  const WorkingDirectory here;
  write_text(here / "s.toml", kHanging);
  const std::vector<std::vector<std::string>> commands = {
      {"simulate"}, {"gradient"}, {"optimize"}, {"equilibrium"}, {"modes"}, {"sweep"},
      {"explain"},  {"check"},    {"animate"},  {"draw"},        {"dump"},  {"cycle"},
      {"tradeoff"}, {"compare"},  {"stress"},   {"list"},        {"export"}};
  for (const auto& words : commands) {
    INFO(words[0]);
    const Outcome help = run_costate({words[0], "--help"}, here.path());
    for (const char* option : {"--set", "--no-files", "--quiet"}) CHECK_THAT(help.out, Contains(option));
  }
  const std::string set = "rigid_body.arm.mass_kg=2";
  for (const auto& words : std::vector<std::vector<std::string>>{
           {"simulate", "s.toml"},
           {"equilibrium", "s.toml", "--output", "out", "--hold", "shoulder.angle"},
           {"modes", "s.toml", "--output", "out"},
           {"sweep", "s.toml", "--coordinate", "shoulder.angle", "--from", "0", "--to", "0.1", "--output", "out"},
           {"explain", "s.toml"},
           {"animate", "s.toml", "--output", "m.gltf"},
           {"draw", "s.toml", "--output", "m.svg"},
           {"dump", "s.toml"}}) {
    std::vector<std::string> all = words;
    all.insert(all.end(), {"--no-files", "--quiet", "--set", set});
    const Outcome o = run_costate(all, here.path());
    INFO(words[0] << ": " << o.err);
    CHECK(o.status == 0);
    if (words[0] != "dump") CHECK(o.out.empty());
    CHECK(here.entries() == std::vector<std::string>{"s.toml"});
  }
}

TEST_CASE("newcomers: a formulation alone brings a method that goes with it") {
  const WorkingDirectory here;
  for (const auto& f : costate::formulations()) {
    INFO(f.name);
    const Json j = costate_json({"gradient", kFiveBar, "--formulation", f.name, "--no-files"}, here.path());
    CHECK(j.at("formulation") == f.name);
    for (const std::string name : {"L01", "L02"})
      CHECK(j.at("gradient").at(name).get<double>() == Approx(kGradient.at(name)).epsilon(2e-2));  // penalties are soft
  }
  // What was asked for by name is not exchanged.
  const Outcome both = run_costate({"gradient", kFiveBar, "--formulation", "penalty-second-order", "--method",
                                    "hand-adjoint", "--set", "run.integrator=idas", "--no-files"},
                                   here.path());
  if (both.status != 0) CHECK_THAT(both.err, Contains("--"));
}

TEST_CASE("newcomers: joints of two kinds may have one name") {
  const WorkingDirectory here;
  std::string text = kHanging;
  // The pendulum once more, beside the first one, on a slide of the same name that stands still.
  text.insert(text.find("[start]"), R"([rigid_body.sled]
x_m = 0
y_m = 1
z_m = 0
mass_kg = 1
inertia_xx_kg_m2 = 0.01
inertia_yy_kg_m2 = 0.01
inertia_zz_kg_m2 = 0.01

[point.B]
ground = true
x_m = 0
y_m = 1
z_m = 0

[point.bore]
on = "sled"
x_m = 0
y_m = 0
z_m = 0

[translational.shoulder]
points = ["B", "bore"]
axis_first = [1, 0, 0]
displacement = "slide"

)");
  text.replace(text.find("[\"shoulder.angle\"]"), 18, "[\"shoulder.angle\", \"slide.displacement\"]");
  write_text(here / "s.toml", text);
  const Outcome o = run_costate({"simulate", "s.toml", "--no-files"}, here.path());
  INFO(o.err);
  CHECK(o.status == 0);
}

TEST_CASE("newcomers: a sweep of a driven coordinate names its driver") {
  const WorkingDirectory here;
  std::string text = kHanging;
  text.insert(text.find("[start]"), "[driver.motor]\ncoordinate = \"shoulder.angle\"\nlaw = 0.1\n\n");
  text.replace(text.find("given = [\"shoulder.angle\"]"), 26, "given = []");
  write_text(here / "s.toml", text);
  const Outcome o = run_costate(
      {"sweep", "s.toml", "--coordinate", "shoulder.angle", "--from", "0", "--to", "1", "--no-files"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("[driver.motor]") && Contains("a sweep cannot lead it"));
}

TEST_CASE("newcomers: a rate that others override is told") {
  const WorkingDirectory here;
  std::string text = kHanging;
  text.replace(text.find("mass_kg = 1\n"), 12, "vz_m_per_s = 3\nmass_kg = 1\n");
  write_text(here / "s.toml", text);
  const Json told = costate_json({"simulate", "s.toml", "--no-files"}, here.path());
  REQUIRE(told.at("warnings").size() == 1);
  CHECK_THAT(told.at("warnings")[0].get<std::string>(),
             Contains("'arm.z' at a rate of") && Contains("not 3") && Contains("given_velocities"));
  // The same rate, given or agreeing with what is given, is none to tell of.
  const Json given =
      costate_json({"simulate", "s.toml", "--no-files", "--set", "start.given_velocities=['arm.z']"}, here.path());
  CHECK(given.at("warnings").empty());
  // The arm turns about y by -6 rad/s: its middle, half a metre out, rises by 3 m/s.
  const Json agrees = costate_json(
      {"simulate", "s.toml", "--no-files", "--set", "hinge.shoulder.angular_velocity_rad_per_s=-6"}, here.path());
  CHECK(agrees.at("warnings").empty());
}

TEST_CASE("newcomers: what rounding leaves of a zero is printed as one") {
  const WorkingDirectory here;
  write_text(here / "s.toml", kHanging);
  // It hangs straight down: the end that is hinged is where the ground's point is.
  const Outcome o = run_costate({"equilibrium", "s.toml", "--hold", "none"}, here.path());
  REQUIRE(o.status == 0);
  const std::string listed = o.out.substr(o.out.find("Positions"));
  CHECK_THAT(listed, Contains("end.x") && !Contains("e-1"));
}

TEST_CASE("newcomers: --set may lead a parameter beyond its bounds") {
  const WorkingDirectory here;
  // k1 is bounded by 1 .. 1000.
  const std::vector<std::string> set = {"--set", "spring.S1.stiffness_N_per_m=2000", "--no-files"};
  std::vector<std::string> words = {"simulate", kFiveBar};
  words.insert(words.end(), set.begin(), set.end());
  const Json j = costate_json(words, here.path());
  CHECK_THAT(j.at("warnings").dump(), Contains("Parameter 'k1' starts at 2000, above its upper bound 1000"));
  words = {"optimize", kFiveBar, "--parameters", "k1"};
  words.insert(words.end(), set.begin(), set.end());
  const Outcome o = run_costate(words, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("outside the bounds 1 .. 1000"));
  CHECK(here.entries().empty());
}

TEST_CASE("newcomers: outputs of one's own that are no numbers are told with their times") {
  const WorkingDirectory here;
  write_text(here / "s.toml", file_text(kFiveBar) + "[output.q]\nformula = \"sqrt(0.5 - t)\"\nunit = \"1\"\n");
  const Json j =
      costate_json({"simulate", "s.toml", "--t-end", "1", "--output-step", "0.25", "--output", "o"}, here.path());
  REQUIRE(j.at("warnings").size() == 1);
  CHECK_THAT(j.at("warnings").at(0).get<std::string>(),
             Contains("'q' is not a number at 2 of 5 samples, at t = 0.75 s"));
  CHECK(costate_json({"simulate", "s.toml", "--t-end", "0.5", "--output", "o"}, here.path()).at("warnings").empty());
}
