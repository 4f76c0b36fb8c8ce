// What people meet in their first hours: options that mean the same everywhere, choices that complete themselves,
// messages that name the cause.
#include <catch2/catch.hpp>
#include <filesystem>
#include <regex>
#include <sstream>

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

TEST_CASE("newcomers: outputs that are no numbers are told of stored motions, too") {
  const WorkingDirectory here;
  write_text(here / "s.toml", file_text(kFiveBar) + "[output.q]\nformula = \"sqrt(0.5 - t)\"\nunit = \"1\"\n");
  const Json g = costate_json({"gradient", "s.toml", "--t-end", "1", "--report", "--output", "g"}, here.path());
  CHECK_THAT(g.at("warnings").dump(), Contains("'q' is not a number at"));
  CHECK_THAT(file_text(here / "g/gradient.html"),
             Contains("'q' is not a number at") || Contains("&#39;q&#39; is not a"));
  const Json o = costate_json(
      {"optimize", "s.toml", "--t-end", "1", "--max-evaluations", "1", "--no-certificate", "--output", "o"},
      here.path());
  for (const char* motion : {"before", "after"})
    CHECK_THAT(o.at("notes").dump(), Contains(std::string("The motion '") + motion + "': 'q' is not a number at"));
}

namespace {

/// The arm with a cost and a parameter within bounds.
std::string bounded() {
  return kHanging +
         "[[cost.running]]\nkind = \"square\"\noutput = \"shoulder.angle\"\n\n"
         "[parameter.m]\nnumber = \"rigid_body.arm.mass_kg\"\nlower = 0.5\nupper = 1.5\n";
}

}  // namespace

TEST_CASE("newcomers: every command tells where --set leads a parameter beyond its bounds") {
  const WorkingDirectory here;
  write_text(here / "s.toml", bounded());
  for (const auto& words : std::vector<std::vector<std::string>>{
           {"simulate", "s.toml", "--json"},
           {"gradient", "s.toml", "--parameters", "m", "--json"},
           {"check", "s.toml", "--parameters", "m", "--formulations", "baumgarte", "--methods",
            "idas-forward,hand-tangent", "--no-motions", "--json"},
           {"equilibrium", "s.toml", "--hold", "shoulder.angle", "--json"},
           {"modes", "s.toml", "--json"},
           {"sweep", "s.toml", "--coordinate", "shoulder.angle", "--from", "0", "--to", "0.1", "--json"},
           {"compare", "s.toml", "s.toml", "--json"},
           {"explain", "s.toml", "--json"},
           {"stress", "s.toml", "--axes", "step", "--budget", "1", "--json"},
           {"export", "s.toml", "-o", "s.fmu", "--json"},
           {"animate", "s.toml", "-o", "s.svg", "--json"},
           {"draw", "s.toml"},
           {"dump", "s.toml"},
           {"list", "s.toml"}}) {
    std::vector<std::string> all = words;
    all.insert(all.end(), {"--no-files", "--set", "rigid_body.arm.mass_kg=2"});
    const Outcome o = run_costate(all, here.path());
    INFO(words[0] << ": " << o.err);
    CHECK(o.status == 0);
    const std::string note = "Parameter 'm' starts at 2, above its upper bound 1.5 for optimization.";
    const std::size_t told = o.err.find("warning: "), at = o.err.find(note);
    CHECK(told < at);
    CHECK(at != std::string::npos);
    CHECK(o.err.find(note, at + 1) == std::string::npos);  // once
    if (words.back() == "--json") CHECK_THAT(Json::parse(o.out).at("warnings").dump(), Contains(note));
  }
}

TEST_CASE("newcomers: studies and baselines leave no files where none are wanted") {
  const WorkingDirectory here;
  std::filesystem::create_directory(here / "tmp");
  write_text(here / "s.toml", "[[design]]\nname = \"d\"\nscene = \"" + kFiveBar +
                                  "\"\ntask = \"gradient\"\nkind = \"sobol\"\ncount = 2\noptions = { t_end = 0.1 }\n"
                                  "[design.vary]\n\"spring.S1.stiffness_N_per_m\" = { from = 80, to = 120 }\n");
  const auto study = [&](std::vector<std::string> more) {
    more.insert(more.begin(),
                {"TMPDIR=" + (here / "tmp").string(), COSTATE_EXECUTABLE, "study", "s.toml", "--no-files"});
    return Process("/usr/bin/env", more, here.path()).finish();
  };
  const Outcome text = study({});
  INFO(text.err);
  CHECK(text.status == 0);
  CHECK_THAT(text.out, Contains("d.2") && !Contains("results in"));
  const Json j = Json::parse(study({"--json"}).out);
  CHECK(j.at("status") == "ok");
  REQUIRE(j.at("runs").size() == 2);
  CHECK(j.at("runs").at(1).at("psi").is_number());
  CHECK(j.at("runs").at(1).at("directory").is_null());
  CHECK_THAT(study({"--shard", "1/2"}).err, Contains("exclude --no-files"));
  CHECK(here.entries() == std::vector<std::string>{"s.toml", "tmp"});

  std::filesystem::create_directory(here / "base");
  write_text(here / "base/b.json",
             Json{{"scene", kFiveBar}, {"command", "simulate"}, {"options", {{"t-end", 0.1}}}}.dump() + "\n");
  REQUIRE(run_costate({"regress", "base", "--update"}, here.path()).status == 0);
  const std::string kept = file_text(here / "base/b.json");
  const Outcome same = run_costate({"regress", "base", "--no-files"}, here.path());
  INFO(same.err);
  CHECK(same.status == 0);
  CHECK_THAT(run_costate({"regress", "base", "--no-files", "--update"}, here.path()).err,
             Contains("excludes --no-files"));
  CHECK(file_text(here / "base/b.json") == kept);
}

TEST_CASE("newcomers: an angle is called as what has it, or as its coordinate, everywhere") {
  const WorkingDirectory here;
  const auto psi = [&](const std::string& text) {
    write_text(here / "s.toml", text);
    return costate_json({"simulate", "s.toml", "--no-files"}, here.path()).at("psi").get<double>();
  };
  const auto refused = [&](const std::string& text) {
    write_text(here / "s.toml", text);
    const Outcome o = run_costate({"simulate", "s.toml", "--no-files"}, here.path());
    CHECK(o.status == 1);
    return o.err;
  };
  const auto with = [](std::string text, const std::string& from, const std::string& to) {
    REQUIRE(text.find(from) != std::string::npos);
    return text.replace(text.find(from), from.size(), to);
  };
  const std::string spring =
      "\n[torsion_spring.t]\nangle = \"shoulder\"\nstiffness_N_m_per_rad = 3\n\n"
      "[friction.f]\ncoordinate = \"shoulder.angle\"\nnormal_force_N = 1\nradius_m = 0.1\n"
      "static_coefficient = 0.2\ndynamic_coefficient = 0.1\ntransition_velocity_m_per_s = 0.1\n";
  const std::string text = bounded() + spring;
  const double expected = psi(text);
  CHECK(expected > 0);
  CHECK(psi(with(text, "t]\nangle = \"shoulder\"", "t]\nangle = \"shoulder.angle\"")) == expected);
  CHECK(psi(with(text, "coordinate = \"shoulder.angle\"", "coordinate = \"shoulder\"")) == expected);
  CHECK(psi(with(text, "given = [\"shoulder.angle\"]", "given = [\"shoulder\"]")) == expected);
  // Where it is declared, too.
  CHECK(psi(with(text, "0]\nangle = \"shoulder\"", "0]\nangle = \"shoulder.angle\"")) == expected);
  // Of outputs there are several, and each has its name.
  CHECK_THAT(refused(with(text, "output = \"shoulder.angle\"", "output = \"shoulder\"")),
             Contains("There is no output 'shoulder'. Did you mean one of shoulder.angle, shoulder.angle_dot"));
  const Outcome sweep =
      run_costate({"sweep", "s.toml", "--coordinate", "shoulder", "--from", "0", "--to", "1"}, here.path());
  CHECK(sweep.status == 1);  // of the scene above
  write_text(here / "s.toml", text);
  const Json led = costate_json(
      {"sweep", "s.toml", "--coordinate", "shoulder", "--from", "0", "--to", "1", "--no-files"}, here.path());
  CHECK(led.at("coordinate") == "shoulder.angle");
  // What has several coordinates stands for none of them.
  const std::string disk =
      "[body.disk]\nx_m = 0\ny_m = 0\nangle_rad = 0\nmass_kg = 1\ninertia_kg_m2 = 1\n"
      "[driver.d]\ncoordinate = \"disk\"\nlaw = 0.1\n[start]\ngiven = [\"disk.x\", \"disk.y\"]\n[run]\nt_end_s = 0.1\n";
  CHECK_THAT(refused(disk), Contains("'disk' has several coordinates, name one of them: disk.angle, disk.x, disk.y."));
  // Angular velocities by their other names.
  const std::string named = with(disk, "coordinate = \"disk\"", "coordinate = \"disk.angle\"");
  CHECK_THAT(refused(with(named, "angle_rad = 0", "omega_rad_per_s = 1")),
             Contains("Did you mean 'angular_velocity_rad_per_s'?"));
  CHECK_THAT(refused(with(text, "mass_kg = 1\n", "mass_kg = 1\nangular_velocity_y_rad_per_s = 1\n")),
             Contains("Did you mean 'omega_y_rad_per_s'?"));
  CHECK_THAT(refused(with(text, "output = \"shoulder.angle\"", "output = \"shoulder.omega\"")),
             Contains("Did you mean 'shoulder.angle_dot'?"));
}

TEST_CASE("newcomers: no table has a zero with a sign or a number that is rounding") {
  const WorkingDirectory here;
  write_text(here / "s.toml", bounded());
  const std::regex noise(R"((^|[ ,])-?[0-9.]*(e-1[4-9]|e-[2-9][0-9])|(^|[ ,])-0(\.0*)?($|[ ,]))");
  const auto lines_of_noise = [&](const std::string& text) {
    std::string found, line;
    std::istringstream in(text);
    while (std::getline(in, line))
      if (line.find("out of balance") == std::string::npos && std::regex_search(line, noise)) found += line + "\n";
    return found;
  };
  for (const auto& words : std::vector<std::vector<std::string>>{
           {"equilibrium", "s.toml", "--hold", "none"},
           {"equilibrium", "s.toml", "--hold", "shoulder.angle", "--derivatives"},
           {"modes", "s.toml", "--equilibrium", "--hold", "none"},
           {"sweep", "s.toml", "--coordinate", "shoulder.angle", "--from", "-0.5", "--to", "0.5", "--count", "5"},
           {"gradient", "s.toml", "--parameters", "m"}}) {
    std::vector<std::string> all = words;
    all.push_back("--no-files");
    const Outcome o = run_costate(all, here.path());
    INFO(words[0] << o.err);
    CHECK(o.status == 0);
    CHECK(lines_of_noise(o.out) == "");
    all.push_back("--json");
    CHECK(run_costate(all, here.path()).out.find("-0.0,") == std::string::npos);
  }
}
