// The files of a run: trajectories as HDF5 and CSV with units and the scene inside, and dump.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/record/csv_file.h"
#include "costate/record/hdf5_file.h"
#include "costate/scene/scene.h"
#include "five_bar.h"
#include "process.h"
#include "support/paths.h"

using costate::TrajectoryTable;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::kFiveBar;
using costate::test::kPsi;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

const std::vector<double>& column(const TrajectoryTable& table, const std::string& group, const std::string& name,
                                  const std::string& unit) {
  const auto* c = table.find(group, name);
  INFO(group << "/" << name);
  REQUIRE(c != nullptr);
  CHECK(c->unit == unit);
  return c->values;
}

}  // namespace

TEST_CASE("simulate: a trajectory with everything, units and the scene") {
  const WorkingDirectory here;
  const Json j = costate_json({"simulate", kFiveBar, "--rtol", "1e-10"}, here.path());
  CHECK(here.entries() == std::vector<std::string>{"results", "results/five_bar", "results/five_bar/simulate.json",
                                                   "results/five_bar/trajectory.h5"});
  CHECK(j.at("files") == Json({"results/five_bar/trajectory.h5"}));
  const TrajectoryTable table = costate::read_hdf5(here / "results/five_bar/trajectory.h5");

  REQUIRE(table.time_s.size() == 501);
  CHECK(table.time_s.front() == 0);
  CHECK(table.time_s.back() == 5);
  const auto &x = column(table, "coordinates", "P2.x", "m"), &y = column(table, "coordinates", "P2.y", "m");
  const auto &vx = column(table, "velocities", "P2.x", "m/s"), &ay = column(table, "accelerations", "P2.y", "m/s^2");
  column(table, "multipliers", "bar.A1.length", "N/m");
  const auto& force = column(table, "outputs", "S1.force", "N");
  const auto& energy = column(table, "outputs", "energy.total", "J");

  // At rest at the start; point 2 at 5 s from the independent program of the reference.
  CHECK(x.front() == Approx(0.5).epsilon(1e-12));
  CHECK(y.front() == Approx(-2).epsilon(1e-12));
  CHECK(vx.front() == Approx(0).margin(1e-12));
  CHECK(std::abs(ay.front()) > 1);
  CHECK(force.front() == Approx(0).margin(1e-9));
  CHECK(x.back() == Approx(0.11596831830186694).epsilon(1e-6));
  CHECK(y.back() == Approx(-2.3037834442252776).epsilon(1e-6));
  for (const double e : energy) CHECK(e == Approx(energy.front()).margin(1e-5));
  // psi once more, from the samples by Simpson's rule.
  double psi = 0;
  const auto square = [&](std::size_t k) { return std::pow(x[k] - 0.5, 2) + std::pow(y[k] + 2, 2); };
  for (std::size_t k = 0; k + 2 < x.size(); k += 2)
    psi += (table.time_s[k + 2] - table.time_s[k]) / 6 * (square(k) + 4 * square(k + 1) + square(k + 2));
  CHECK(psi == Approx(kPsi).epsilon(1e-6));

  // The scene inside is the scene, and the settings are those of the summary.
  const auto scene = costate::Scene::parse(table.scene_text, "trajectory.h5");
  CHECK(scene.dump() == costate::Scene::load(kFiveBar).dump());
  CHECK(table.settings.at("rtol") == 1e-10);
  CHECK(table.settings.at("psi") == j.at("psi"));
  write_text(here / "again.toml", table.scene_text);
  CHECK(costate_json({"simulate", "again.toml", "--rtol", "1e-10", "--no-files"}, here.path()).at("psi") ==
        j.at("psi"));
}

TEST_CASE("simulate --outputs: what is asked for alone, with the numbers that everything has") {
  const WorkingDirectory here;
  costate_json({"simulate", kFiveBar, "--output", "all"}, here.path());
  const Json j = costate_json({"simulate", kFiveBar, "--output", "some", "--csv", "--outputs",
                               "energy.total,P2.x,time,P2.y_ddot,P2.x,lambda.bar.A1.length"},
                              here.path());
  const TrajectoryTable all = costate::read_hdf5(here / "all/trajectory.h5"),
                        some = costate::read_hdf5(here / "some/trajectory.h5");
  REQUIRE(some.columns.size() == 4);
  CHECK(some.time_s == all.time_s);
  for (const auto& c : some.columns) {
    INFO(c.group << "/" << c.name);
    CHECK(column(some, c.group, c.name, c.unit) == column(all, c.group, c.name, c.unit));
  }
  CHECK(j.at("terminal").size() == 4);
  CHECK(j.at("terminal").at("P2.x") == some.find("coordinates", "P2.x")->values.back());
  CHECK(run_costate({"simulate", kFiveBar, "--outputs", "P2.x", "--report"}, here.path()).status == 1);
  const auto unknown = run_costate({"simulate", kFiveBar, "--outputs", "P2.z"}, here.path());
  CHECK(unknown.status == 1);
  CHECK(unknown.err.find("P2.x") != std::string::npos);
}

TEST_CASE("simulate: the scene inside holds what was overridden") {
  const WorkingDirectory here;
  costate_json({"simulate", kFiveBar, "--output", "out", "--set", "spring.S1.natural_length_m=2.4"}, here.path());
  const auto scene = costate::Scene::parse(costate::read_hdf5(here / "out/trajectory.h5").scene_text, "trajectory.h5");
  CHECK(scene.mechanism()
            ->numbers()[static_cast<std::size_t>(scene.mechanism()->number("spring.S1.natural_length_m"))]
            .value == 2.4);
}

TEST_CASE("simulate: sample times") {
  const WorkingDirectory here;
  const auto times = [&](const std::vector<std::string>& options) {
    std::vector<std::string> arguments = {"simulate", kFiveBar, "--output", "out"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    costate_json(arguments, here.path());
    return costate::read_hdf5(here / "out/trajectory.h5").time_s;
  };
  CHECK(times({"--output-step", "0.5", "--t-end", "2"}) == std::vector<double>{0, 0.5, 1, 1.5, 2});
  // The end is a sample in any case.
  CHECK(times({"--output-step", "0.75", "--t-end", "2"}) == std::vector<double>{0, 0.75, 1.5, 2});
  CHECK(times({"--output-step", "10"}) == std::vector<double>{0, 5});
  CHECK(times({"--set", "run.output_step_s=1"}) == std::vector<double>{0, 1, 2, 3, 4, 5});
  CHECK(times({"--set", "run.t_start_s=4", "--output-step", "0.5"}) == std::vector<double>{4, 4.5, 5});
}

TEST_CASE("simulate: CSV beside HDF5, the same numbers") {
  const WorkingDirectory here;
  const Json j = costate_json({"simulate", kFiveBar, "--csv", "--output", "out"}, here.path());
  CHECK(j.at("files") == Json({"out/trajectory.h5", "out/trajectory.csv"}));
  const TrajectoryTable h5 = costate::read_hdf5(here / "out/trajectory.h5"),
                        csv = costate::read_csv(here / "out/trajectory.csv");
  CHECK(csv.time_s == h5.time_s);
  REQUIRE(csv.columns.size() == h5.columns.size());
  for (std::size_t i = 0; i < csv.columns.size(); ++i) {
    INFO(h5.columns[i].name);
    CHECK(csv.columns[i].name == h5.columns[i].name);
    CHECK(csv.columns[i].group == h5.columns[i].group);
    CHECK(csv.columns[i].unit == h5.columns[i].unit);
    CHECK(csv.columns[i].values == h5.columns[i].values);
  }
  CHECK(file_text(here / "out/trajectory.csv").rfind("time [s],coordinates/P1.x [m],", 0) == 0);
}

TEST_CASE("option --no-files writes nothing") {
  const WorkingDirectory here;
  for (const std::string command : {"simulate", "gradient", "optimize"})
    costate_json({command, kFiveBar, "--no-files"}, here.path());
  CHECK(here.entries().empty());
}

TEST_CASE("simulate: the same run and end with files and without") {
  const WorkingDirectory here;
  for (const std::string formulation : {"index1", "baumgarte"}) {
    INFO(formulation);
    const Json with =
        costate_json({"simulate", kFiveBar, "--formulation", formulation, "--output", "out"}, here.path());
    const Json without = costate_json({"simulate", kFiveBar, "--formulation", formulation, "--no-files"}, here.path());
    CHECK(without.at("psi") == with.at("psi"));
    CHECK(without.at("terminal") == with.at("terminal"));
    CHECK(without.at("counters").at("steps") == with.at("counters").at("steps"));
  }
}

TEST_CASE("a failed run leaves the results of an earlier one as they were") {
  const WorkingDirectory here;
  costate_json({"simulate", kFiveBar, "--output", "out"}, here.path());
  const std::string trajectory = file_text(here / "out/trajectory.h5"), summary = file_text(here / "out/simulate.json");
  costate_json({"simulate", kFiveBar, "--output", "out", "--set", "spring.S1.stiffness_N_per_m=1e300"}, here.path(), 1);
  CHECK(file_text(here / "out/trajectory.h5") == trajectory);
  CHECK(file_text(here / "out/simulate.json") == summary);
  CHECK(here.entries() == std::vector<std::string>{"out", "out/simulate.json", "out/trajectory.h5"});
}

TEST_CASE("the same run twice gives the same trajectory, byte for byte but for times") {
  const WorkingDirectory here;
  TrajectoryTable table[2];
  for (TrajectoryTable& t : table) {
    costate_json({"simulate", kFiveBar, "--output", "out"}, here.path());
    t = costate::read_hdf5(here / "out/trajectory.h5");
  }
  for (std::size_t i = 0; i < table[0].columns.size(); ++i)
    CHECK(table[0].columns[i].values == table[1].columns[i].values);
}

TEST_CASE("dump: the scene as it was understood, dumping it again gives the same text") {
  const WorkingDirectory here;
  for (const char* model :
       {"/five_bar/five_bar.toml", "/five_bar/five_bar_above.toml", "/slider_crank/slider_crank.toml"}) {
    INFO(model);
    const auto once = costate::test::run_costate({"dump", std::string(COSTATE_MODELS_DIR) + model}, here.path());
    CHECK(once.status == 0);
    CHECK(once.err.empty());
    write_text(here / "once.toml", once.out);
    const auto twice = costate::test::run_costate({"dump", "once.toml"}, here.path());
    CHECK(twice.status == 0);
    CHECK(twice.out == once.out);
  }
  // Overrides are part of it.
  const auto changed = costate::test::run_costate({"dump", kFiveBar, "--set", "run.t_end_s=2"}, here.path());
  write_text(here / "changed.toml", changed.out);
  CHECK(costate_json({"simulate", "changed.toml", "--no-files"}, here.path()).at("settings").at("t_end_s") == 2);
  CHECK(costate_json({"dump", kFiveBar, "--set", "run.t_end_s=2"}, here.path()).at("scene") == changed.out);
}

TEST_CASE("the slider-crank's published cost through the tool") {
  const WorkingDirectory here;
  const std::string scene = COSTATE_MODELS_DIR "/slider_crank/slider_crank.toml";
  const Json j = costate_json({"gradient", scene, "--rtol", "1e-11", "--no-files"}, here.path());
  CHECK(j.at("psi").get<double>() == Approx(3.3366067994827844).epsilon(1e-7));
  CHECK(j.at("gradient").at("k").get<double>() == Approx(0.3334481061284379).epsilon(1e-7));
  CHECK(j.at("gradient").at("c").get<double>() == Approx(-0.3637540339709498).epsilon(1e-7));
}

TEST_CASE("simulate: the file lists events, unless the scene says not to") {
  const WorkingDirectory here;
  const std::string scene = COSTATE_MODELS_DIR "/walker/arc_feet.toml";
  const Json listed = costate_json({"simulate", scene, "--t-end", "3", "--output", "listed"}, here.path());
  const Json left_out = costate_json(
      {"simulate", scene, "--t-end", "3", "--set", "run.events=false", "--output", "left_out"}, here.path());
  const TrajectoryTable a = costate::read_hdf5(here / "listed/trajectory.h5"),
                        b = costate::read_hdf5(here / "left_out/trajectory.h5");
  REQUIRE(listed.at("events").size() >= 2);
  REQUIRE(a.events.size() == listed.at("events").size());
  CHECK(a.events.front().t == listed.at("events")[0].at("t"));
  CHECK(b.events.empty());
  CHECK(listed.at("terminal") == left_out.at("terminal"));
}
