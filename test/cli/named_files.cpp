// Files that a scene names (a road's profile): part of what a run is, and found from wherever the scene is written.
#include <catch2/catch.hpp>
#include <filesystem>

#include "process.h"
#include "support/paths.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::one_object;
using costate::test::Outcome;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;
namespace fs = std::filesystem;

namespace {

const std::string kCases = COSTATE_SOURCE_DIR "/test/cases/";

void put_scene(const WorkingDirectory& here) {
  fs::create_directories(here / "scenes");
  fs::copy_file(kCases + "road_file.toml", here / "scenes/road_file.toml");
  fs::copy_file(kCases + "road.txt", here / "scenes/road.txt");
}

/// The same profile with one digit changed.
void change_road(const WorkingDirectory& here) {
  std::string road = file_text(here / "scenes/road.txt");
  char& digit = road[road.size() - 3];
  digit = digit == '1' ? '2' : '1';
  write_text(here / "scenes/road.txt", road);
}

const std::vector<std::string> kRun = {"optimize", "scenes/road_file.toml", "--output", "out", "--no-certificate"};

std::vector<std::string> with(std::vector<std::string> words, const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

}  // namespace

TEST_CASE("named files: a run is not resumed with another road") {
  const WorkingDirectory here;
  put_scene(here);
  costate_json(with(kRun, {"--max-evaluations", "2"}), here.path());
  const std::string journal = file_text(here / "out/evaluations.jsonl");
  change_road(here);
  const Json j = costate_json(with(kRun, {"--max-evaluations", "3", "--resume"}), here.path(), 1);
  CHECK_THAT(j.at("error").get<std::string>(), Contains("cannot resume") && Contains("files/road.post.law.file"));
  CHECK(file_text(here / "out/evaluations.jsonl") == journal);
}

TEST_CASE("named files: nor with another tyre file, what it writes finds the file") {
  const WorkingDirectory here;
  fs::create_directory(here / "scenes");
  std::string tyre = file_text(COSTATE_MODELS_DIR "/tyres/formula_student_61.tir");
  write_text(here / "scenes/tyre.tir", tyre);
  write_text(here / "scenes/wheel.toml", R"([gravity]
z_m_per_s2 = -9.81
[rigid_body.wheel]
x_m = 0
y_m = 0
z_m = 0.19
vx_m_per_s = 10
omega_y_rad_per_s = 52
mass_kg = 10
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1
inertia_zz_kg_m2 = 1
[point.hub]
on = "wheel"
x_m = 0
y_m = 0
z_m = 0
[road.plain]
kind = "flat"
[tyre.T]
wheel = "hub"
road = "plain"
stiffness_N_per_m = 1.6e5
model = "magic_formula"
tir_file = "tyre.tir"
[start]
given = ["wheel"]
[parameter.m]
number = "rigid_body.wheel.mass_kg"
[[cost.running]]
kind = "square"
output = "wheel.z"
[run]
t_end_s = 0.05
rtol = 1e-6
parameters = ["m"]
)");
  const std::vector<std::string> run = {"optimize", "scenes/wheel.toml", "--output",
                                        "out",      "--no-certificate",  "--max-evaluations"};
  costate_json(with(run, {"2"}), here.path());
  CHECK(costate_json({"simulate", "out/optimized.toml", "--no-files"}, here.path()).at("status") == "ok");
  tyre.replace(tyre.find("FNOMIN"), 6, "FNOMIN   ");  // blanks alone
  write_text(here / "scenes/tyre.tir", tyre);
  const Json j = costate_json(with(run, {"3", "--resume"}), here.path(), 1);
  CHECK_THAT(j.at("error").get<std::string>(), Contains("cannot resume") && Contains("files/tyre.T.tir_file"));
}

TEST_CASE("named files: a study begins a run anew when its road changed") {
  const WorkingDirectory here;
  put_scene(here);
  write_text(here / "study.toml",
             "[[run]]\nname = \"a\"\nscene = \"scenes/road_file.toml\"\noptions = { max_evaluations = 2, "
             "no_certificate = true }\n");
  CHECK(costate_json({"study", "study.toml"}, here.path()).at("runs").at(0).at("status") == "ok");
  CHECK(costate_json({"study", "study.toml"}, here.path()).at("runs").at(0).at("status") == "kept");
  change_road(here);
  CHECK(costate_json({"study", "study.toml"}, here.path()).at("runs").at(0).at("status") == "ok");
}

TEST_CASE("named files: optimized.toml and dump load from where they are written") {
  const WorkingDirectory here;
  put_scene(here);
  const Json j = costate_json(with(kRun, {"--max-evaluations", "2"}), here.path());
  const Json again = costate_json({"simulate", "out/optimized.toml", "--no-files"}, here.path());
  CHECK(again.at("parameters") == j.at("parameters"));
  CHECK(again.at("psi").get<double>() == Approx(j.at("psi").get<double>()).epsilon(1e-5));
  CHECK_THAT(file_text(here / "out/optimized.toml"), Contains("\"../scenes/road.txt\""));
  // The folder may move as a whole.
  fs::create_directory(here / "elsewhere");
  fs::rename(here / "scenes", here / "elsewhere/scenes");
  fs::rename(here / "out", here / "elsewhere/out");
  CHECK(costate_json({"simulate", "elsewhere/out/optimized.toml", "--no-files"}, here.path()).at("psi") ==
        again.at("psi"));
  // A dump goes anywhere.
  const Outcome dump = run_costate({"dump", "elsewhere/scenes/road_file.toml"}, here.path());
  REQUIRE(dump.status == 0);
  fs::create_directories(here / "far/away");
  write_text(here / "far/away/dump.toml", dump.out);
  CHECK(costate_json({"simulate", "far/away/dump.toml", "--no-files"}, here.path()).at("status") == "ok");
  CHECK(run_costate({"dump", "far/away/dump.toml"}, here.path()).out == dump.out);
}

TEST_CASE("named files: a path of the command line counts from the scene, one of an included file from that") {
  const WorkingDirectory here;
  put_scene(here);
  fs::copy_file(here / "scenes/road.txt", here / "scenes/other.txt");
  fs::create_directory(here / "runs");
  write_text(here / "runs/run.toml", "include = [\"../scenes/road_file.toml\"]\n[run]\nt_end_s = 0.2\n");
  CHECK(costate_json({"simulate", "runs/run.toml", "--no-files"}, here.path()).at("status") == "ok");
  CHECK(costate_json({"simulate", "scenes/road_file.toml", "--no-files", "--set", "road.post.law.file=other.txt",
                      "--t-end", "0.2"},
                     here.path())
            .at("status") == "ok");
  CHECK(costate_json({"simulate", "runs/run.toml", "--no-files", "--set", "road.post.law.file='../scenes/other.txt'"},
                     here.path())
            .at("status") == "ok");
}

TEST_CASE("named files: a file that changes during a run is told") {
  const WorkingDirectory here;
  put_scene(here);
  costate::test::Process process(COSTATE_EXECUTABLE, with(kRun, {"--json"}), here.path());
  REQUIRE(process.wait_until(
      [&] { return file_text(here / "out/evaluations.jsonl").find("\"index\":1") != std::string::npos; }));
  change_road(here);
  const Outcome o = process.finish();
  CHECK(o.status == 0);
  CHECK_THAT(o.err, Contains("road.txt") && Contains("changed while this ran"));
  CHECK_THAT(one_object(o.out).at("notes").dump(), Contains("changed while this ran"));
}
