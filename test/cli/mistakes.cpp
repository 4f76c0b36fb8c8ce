// Every mistake of a user ends with a status other than 0 and a message that names the option, or the place in the
// scene; nothing is left behind.
#include <catch2/catch.hpp>
#include <filesystem>

#include "five_bar.h"
#include "process.h"

using Catch::Matchers::Contains;
using costate::test::file_text;
using costate::test::kFiveBar;
using costate::test::Outcome;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;

namespace fs = std::filesystem;

namespace {

using Words = std::vector<std::string>;

/// The message of a command that must fail without a trace.
std::string mistake(const Words& arguments, const WorkingDirectory& here) {
  const auto before = here.entries();
  const Outcome o = run_costate(arguments, here.path());
  INFO("standard error: " << o.err);
  CHECK(o.signal == 0);
  CHECK((o.status == 1 || o.status == 2));
  CHECK(o.out.empty());
  CHECK_THAT(o.err, Contains("costate: "));
  CHECK(here.entries() == before);
  return o.err;
}

std::string mistake(const Words& arguments) { return mistake(arguments, WorkingDirectory()); }

/// The first line and column at which `text` stands in the five-bar's scene, as ":line:column:".
std::string place_of(const std::string& text) {
  const std::string scene = file_text(kFiveBar);
  const std::size_t at = scene.find(text);
  REQUIRE(at != std::string::npos);
  const auto line = 1 + std::count(scene.begin(), scene.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  const std::size_t start = scene.rfind('\n', at);
  return ":" + std::to_string(line) + ":" + std::to_string(at - start) + ":";
}

/// The message for the five-bar with one piece of its text replaced.
std::string mistake_in_scene(const std::string& command, const std::string& old_text, const std::string& new_text) {
  const WorkingDirectory here;
  std::string scene = file_text(kFiveBar);
  const std::size_t at = scene.find(old_text);
  REQUIRE(at != std::string::npos);
  scene.replace(at, old_text.size(), new_text);
  write_text(here / "scene.toml", scene);
  return mistake({command, "scene.toml"}, here);
}

}  // namespace

TEST_CASE("unknown names are answered with the one that was meant") {
  for (const std::string command : {"simulate", "gradient", "optimize", "check"}) {
    INFO(command);
    CHECK_THAT(mistake({command, kFiveBar, "--parameters", "L03"}), Contains("--parameters") && Contains("'L01'"));
    CHECK_THAT(mistake({command, kFiveBar, "--formulation", "indx1"}),
               Contains("--formulation") && Contains("Did you mean 'index1'?"));
    CHECK_THAT(mistake({command, kFiveBar, "--method", "idas-adjont"}),
               Contains("--method") && Contains("Did you mean 'idas-adjoint'?"));
    CHECK_THAT(mistake({command, kFiveBar, "--parameter", "L01"}),
               Contains("'--parameter'") && Contains("Did you mean '--parameters'?"));
  }
  CHECK_THAT(mistake({"gradient", kFiveBar, "--parameters", "L01,spring.S1.stifness_N_per_m"}),
             Contains("Did you mean 'spring.S1.stiffness_N_per_m'?"));
  CHECK_THAT(mistake({"gradient", kFiveBar, "--integrator", "ida"}),
             Contains("--integrator") && Contains("Did you mean 'idas'?"));
  CHECK_THAT(mistake({"gradient", kFiveBar, "--sensitivity-corrector", "both"}),
             Contains("--sensitivity-corrector") && Contains("simultaneous"));
  CHECK_THAT(mistake({"gradient", kFiveBar, "--cvodes-method", "adam"}),
             Contains("--cvodes-method") && Contains("adams"));
  CHECK_THAT(mistake({"optimize", kFiveBar, "--algorithm", "lbgfs"}),
             Contains("--algorithm") && Contains("Did you mean 'lbfgs'?"));
  CHECK_THAT(mistake({"gradeint", kFiveBar}), Contains("Did you mean 'gradient'?"));
}

TEST_CASE("parameters that cannot vary, or twice") {
  CHECK_THAT(mistake({"gradient", kFiveBar, "--parameters", "L01,L01"}), Contains("--parameters") && Contains("twice"));
  CHECK_THAT(mistake({"gradient", kFiveBar, "--parameters", "L01,spring.S1.natural_length_m"}),
             Contains("--parameters") && Contains("already varied by parameter 'L01'"));
  CHECK_THAT(mistake({"gradient", kFiveBar, "--parameters", "point.P1.x_m"}),
             Contains("--parameters") && Contains("point.P1.x_m") && Contains("first guess"));
}

TEST_CASE("combinations that do not exist are refused with the nearest that does") {
  for (const std::string command : {"gradient", "optimize"}) {
    INFO(command);
    CHECK_THAT(mistake({command, kFiveBar, "--formulation", "index2", "--method", "cvodes-adjoint"}),
               Contains("--method") && Contains("index2") && Contains("'idas-adjoint' with formulation 'index2'"));
  }
  CHECK_THAT(mistake({"check", kFiveBar, "--formulations", "index2", "--methods", "cvodes-adjoint"}),
             Contains("idas-adjoint"));
  CHECK_THAT(
      mistake({"simulate", kFiveBar, "--formulation", "index2", "--integrator", "cvodes"}),
      Contains("--integrator") && Contains("runs on idas") && Contains("'cvodes' takes ") && Contains("baumgarte"));
  // It speaks of what was asked for.
  CHECK_THAT(mistake({"simulate", kFiveBar, "--formulation", "index2", "--integrator", "dopri5"}),
             Contains("'dopri5' integrates") && !Contains("cvodes"));
  CHECK_THAT(mistake({"simulate", kFiveBar, "--formulation", "maggi", "--integrator", "radau5"}),
             Contains("without a residual form, which 'radau5' integrates"));
  CHECK_THAT(mistake({"gradient", kFiveBar, "--method", "idas-adjoint", "--integrator", "cvodes"}),
             Contains("--integrator") && Contains("idas-adjoint"));
  CHECK_THAT(mistake({"check", kFiveBar, "--formulations", "index4"}),
             Contains("--formulations") && Contains("index4"));
  CHECK_THAT(mistake({"check", kFiveBar, "--methods", "adjoint"}), Contains("--methods") && Contains("adjoint"));
  CHECK_THAT(mistake_in_scene("gradient", "\"idas-adjoint\"", "\"idas-adjont\""),
             Contains("scene.toml" + place_of("\"idas-adjoint\"")) && Contains("'idas-adjoint'"));
}

TEST_CASE("numbers out of range") {
  const auto option = [](const std::string& command, const std::string& name, const Words& values) {
    for (const auto& value : values) {
      INFO(name << " " << value);
      CHECK_THAT(mistake({command, kFiveBar, name + "=" + value}), Contains(name));
    }
  };
  for (const std::string command : {"simulate", "gradient", "optimize", "check"}) {
    option(command, "--rtol", {"0", "-1e-8", "1", "nan", "inf", "small", ""});
    option(command, "--atol", {"0", "-1", "nan", "inf", "x", "1", "1e300", "1e-200"});
    option(command, "--t-end", {"0", "-1", "nan", "inf", "x"});
    option(command, "--penalty-alpha", {"0", "-5", "nan"});
    option(command, "--checkpoint-steps", {"-1", "1.5", "many"});
  }
  CHECK_THAT(mistake({"simulate", kFiveBar, "--set", "run.atol=1e-200"}), Contains("'atol'") && Contains("1e-100"));
  CHECK_THAT(mistake({"simulate", kFiveBar, "--t-end=inf"}), Contains("must be finite") && !Contains("must lie after"));
  option("simulate", "--output-step", {"0", "-1", "nan", "inf", "x"});
  CHECK_THAT(mistake({"simulate", kFiveBar, "--output-step=1e-12"}), Contains("output step") && Contains("samples"));
  option("optimize", "--max-evaluations", {"0", "-3", "2.5", "x"});
  option("optimize", "--stop-value", {"nan", "x"});
  option("optimize", "--step-limit-factor", {"-1", "0.5", "nan", "inf", "x"});
  // Who chooses its own steps does not ignore one.
  for (const Words& given : {Words{"simulate", kFiveBar, "--integrator", "dopri5"},
                             Words{"gradient", kFiveBar, "--method", "hand-adjoint"}, Words{"optimize", kFiveBar}}) {
    Words all = given;
    all.insert(all.end(), {"--step", "0.01"});
    CHECK_THAT(mistake(all), Contains("--step: ") && Contains("chooses its own steps") && Contains("max_step_s"));
  }
  option("draw", "--width", {"nan", "inf", "0", "1e9"});
  for (const std::string name : {"--from", "--to"})
    for (const std::string value : {"nan", "inf", "-inf"}) {
      INFO(name << value);
      CHECK_THAT(mistake({"sweep", kFiveBar, "--coordinate", "P2.x", name == "--from" ? "--to" : "--from", "0.4",
                          name + "=" + value}),
                 Contains(name));
    }
  for (const std::string count : {"1", "-3", "100001", "1000000000"})
    CHECK_THAT(mistake({"sweep", kFiveBar, "--coordinate", "P2.x", "--from", "0.4", "--to", "0.5", "--count=" + count}),
               Contains("--count"));
  // Methods without checkpoints do not ignore their number.
  for (const std::string method : {"hand-adjoint", "idas-forward", "discrete-tangent"})
    CHECK_THAT(mistake({"gradient", kFiveBar, "--formulation", method == "discrete-tangent" ? "index3" : "index1",
                        "--method", method, "--checkpoint-steps", "20"}),
               Contains("--checkpoint-steps") && Contains(method));
}

TEST_CASE("scenes that are not there, or no scene") {
  for (const std::string command : {"simulate", "gradient", "optimize", "check", "list", "dump"}) {
    INFO(command);
    CHECK_THAT(mistake({command, "missing.toml"}), Contains("missing.toml"));
    const WorkingDirectory here;
    fs::create_directory(here / "folder");
    CHECK_THAT(mistake({command, "folder"}, here), Contains("folder") && Contains("directory"));
  }
  for (const std::string command : {"simulate", "gradient", "optimize", "check", "dump"})
    CHECK_THAT(mistake({command}), Contains("scene"));
}

TEST_CASE("mistakes in a scene are reported at their place") {
  CHECK_THAT(mistake_in_scene("simulate", "mass_kg = 1\n", "mass_kg = -1\n"),
             Contains("scene.toml" + place_of("1\n\n[bar.B12]")) && Contains("-1"));
  CHECK_THAT(mistake_in_scene("gradient", "from = \"P1\"", "from = \"Q1\""),
             Contains("scene.toml" + place_of("\"P1\"\nto = \"P2\"")) && Contains("'P1'"));
  CHECK_THAT(mistake_in_scene("optimize", "mass_kg = 1\n", "mas_kg = 1\n"),
             Contains("scene.toml" + place_of("mass_kg")) && Contains("Did you mean 'mass_kg'?"));
  CHECK_THAT(mistake_in_scene("check", "t_end_s = 5", "t_end_s = -5"),
             Contains("scene.toml" + place_of("5\nformulation")));
  CHECK_THAT(mistake_in_scene("check", "rtol = 1e-8", "rtol = 2"), Contains("scene.toml:") && Contains("'rtol'"));
  CHECK_THAT(mistake_in_scene("simulate", "rtol = 1e-8", "atol = 1e300"),
             Contains("scene.toml:") && Contains("'atol'"));
  CHECK_THAT(mistake_in_scene("simulate", "[gravity]",
                              "[friction.f]\nfrom = \"A\"\nto = \"P2\"\nnormal_force_N = \"\"\n"
                              "static_coefficient = 0.3\ntransition_velocity_m_per_s = 0.01\n\n[gravity]"),
             Contains("scene.toml:") && Contains("'normal_force_N'"));
  CHECK_THAT(mistake_in_scene("simulate", "[gravity]", "[gravity"), Contains("scene.toml:"));
  CHECK_THAT(mistake_in_scene("optimize", "\"lbfgs\"", "\"bfgs\""), Contains("scene.toml" + place_of("\"lbfgs\"")));
  CHECK_THAT(mistake_in_scene("optimize", "algorithm = ", "max_evaluations = 0\nalgorithm = "),
             Contains("scene.toml:") && Contains("evaluation"));
  // An unreachable start is found when the mechanism is assembled: bar B12 can never reach from P1 to the given P2.
  CHECK_THAT(mistake_in_scene("simulate", "mass_kg = 1.5\n", "mass_kg = 1.5\nlength_m = 9\n"), Contains("scene.toml:"));
}

TEST_CASE("mistakes in overrides name the override") {
  CHECK_THAT(mistake({"simulate", kFiveBar, "--set", "run.t_end_s"}), Contains("--set"));
  CHECK_THAT(mistake({"simulate", kFiveBar, "--set", "=3"}), Contains("--set"));
  CHECK_THAT(mistake({"simulate", kFiveBar, "--set", "run.t_end=3"}), Contains("run.t_end=3") && Contains("'t_end_s'"));
  CHECK_THAT(mistake({"simulate", kFiveBar, "--set", "bar.A1.mass_kg=heavy"}),
             Contains("bar.A1.mass_kg=heavy") && Contains("a number"));
  CHECK_THAT(mistake({"simulate", kFiveBar, "--set", "cost.running[7].weight=1"}),
             Contains("cost.running[7].weight=1"));
  CHECK_THAT(mistake({"simulate", kFiveBar, "--set", "run.t_end_s=-1"}), Contains("run.t_end_s=-1"));
  CHECK_THAT(mistake({"gradient", kFiveBar, "--set", "run.parameters=['L01','L03']"}),
             Contains("L03") && Contains("'L01'"));
}

TEST_CASE("output that cannot be written is refused before anything is computed") {
  for (const std::string command : {"simulate", "gradient", "optimize", "check"}) {
    INFO(command);
    const WorkingDirectory here;
    write_text(here / "file", "mine");
    CHECK_THAT(mistake({command, kFiveBar, "--output", "file"}, here),
               Contains("--output") && Contains("not a directory"));
    CHECK_THAT(mistake({command, kFiveBar, "--output", "file/below"}, here), Contains("--output"));
    CHECK(file_text(here / "file") == "mine");
  }
}

TEST_CASE("a default directory that cannot be written costs a warning, except where a journal is needed") {
  const WorkingDirectory here;
  write_text(here / "results", "mine");
  const Outcome o = run_costate({"simulate", kFiveBar}, here.path());
  CHECK(o.status == 0);
  CHECK_THAT(o.err, Contains("warning") && Contains("--output"));
  CHECK_THAT(o.out, Contains("psi = 0.72687") && !Contains("summary"));
  CHECK_THAT(mistake({"optimize", kFiveBar}, here), Contains("--output") && Contains("--no-files"));
  CHECK(file_text(here / "results") == "mine");
}

TEST_CASE("a refused optimization does not touch the journal of an earlier one") {
  const WorkingDirectory here;
  REQUIRE(run_costate({"optimize", kFiveBar, "--output", "out"}, here.path()).status == 0);
  const std::string journal = file_text(here / "out/evaluations.jsonl");
  for (const Words& wrong :
       {Words{"--formulation", "index2", "--method", "cvodes-adjoint"}, Words{"--algorithm", "bfgs"},
        Words{"--set", "run.parameters=[]"}, Words{"--max-evaluations", "0"}, Words{"--stop-value", "nan"}}) {
    INFO(wrong[1]);
    Words arguments = {"optimize", kFiveBar, "--output", "out"};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    mistake(arguments, here);
    CHECK(file_text(here / "out/evaluations.jsonl") == journal);
  }
  // Another file of that name is nobody's journal.
  write_text(here / "out/evaluations.jsonl", "my notes\n");
  mistake({"optimize", kFiveBar, "--output", "out"}, here);
  CHECK(file_text(here / "out/evaluations.jsonl") == "my notes\n");
}

TEST_CASE("option --resume without files is a contradiction") {
  CHECK_THAT(mistake({"optimize", kFiveBar, "--resume", "--no-files"}), Contains("--resume") && Contains("--no-files"));
}

TEST_CASE("a full standard output is a failure") {
  // /dev/full exists on Linux only.
  if (!fs::exists("/dev/full")) return;
  const WorkingDirectory here;
  const auto status = [&](const std::string& arguments) {
    const std::string line = std::string(COSTATE_EXECUTABLE) + " " + arguments + " > /dev/full";
    return costate::test::Process("/bin/sh", {"-c", line}, here.path()).finish().status;
  };
  CHECK(status("list") == 1);
  CHECK(status("simulate --json --no-files " + kFiveBar) == 1);
  CHECK(status("optimize --no-files " + kFiveBar) == 1);
}
