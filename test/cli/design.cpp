// costate study with designs: where their points lie, what is made of them, that they resume like other runs.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kPendulum = COSTATE_MODELS_DIR "/damped_pendulum/damped_pendulum.toml";
const std::string kStiffness = "spring.strut.stiffness_N_per_m", kDamping = "spring.strut.damping_N_s_per_m";

struct Table {
  std::vector<std::string> heading;
  std::vector<std::vector<std::string>> rows;

  std::vector<double> column(const std::string& name) const {
    const auto at = std::find(heading.begin(), heading.end(), name);
    INFO(name);
    REQUIRE(at != heading.end());
    std::vector<double> x;
    for (const auto& r : rows) x.push_back(std::stod(r.at(static_cast<std::size_t>(at - heading.begin()))));
    return x;
  }
};

Table read_table(const std::string& text) {
  Table t;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells;
    std::string cell;
    for (std::istringstream row(line); std::getline(row, cell, ',');) cells.push_back(cell);
    if (t.heading.empty())
      t.heading = cells;
    else
      t.rows.push_back(cells);
  }
  return t;
}

std::string design(const std::string& rest) {
  return "[[design]]\nname = \"d\"\nscene = \"" + kPendulum + "\"\n" + rest;
}

/// The table of the design "d" of a study.
Table run_design(const WorkingDirectory& here, const std::string& rest) {
  write_text(here / "s.toml", design(rest));
  const Outcome o = run_costate({"study", "s.toml", "--output", "out"}, here.path());
  INFO(o.err);
  REQUIRE(o.status == 0);
  return read_table(file_text(here / "out/d.csv"));
}

/// Whether each of n equal parts of (low, high) holds one of the values.
bool stratified(const std::vector<double>& x, double low, double high) {
  std::vector<int> seen(x.size());
  for (const double v : x) {
    const auto part = static_cast<std::size_t>((v - low) / (high - low) * static_cast<double>(x.size()));
    if (part >= x.size() || seen[part]++ != 0) return false;
  }
  return true;
}

const std::string kShort = "task = \"simulate\"\noptions = { t_end = 0.01 }\n";
const std::string kBoth =
    "[design.vary]\n\"" + kStiffness + "\" = { from = 10, to = 30 }\n\"" + kDamping + "\" = { from = 1, to = 2 }\n";

}  // namespace

TEST_CASE("study: the points of a Sobol sequence, a Latin hypercube, a grid") {
  const WorkingDirectory here;
  const Table sobol = run_design(here, "kind = \"sobol\"\ncount = 7\n" + kShort + kBoth);
  // The sequence begins (1/2, 1/2), (3/4, 1/4), (1/4, 3/4), (3/8, 3/8), (7/8, 7/8), (5/8, 1/8), (1/8, 5/8).
  const std::vector<double> first = {4, 6, 2, 3, 7, 5, 1}, second = {4, 2, 6, 3, 7, 1, 5};
  for (std::size_t i = 0; i < 7; ++i) {
    CHECK(sobol.column(kStiffness)[i] == Approx(10 + 20 * first[i] / 8));
    CHECK(sobol.column(kDamping)[i] == Approx(1 + second[i] / 8));
  }
  const Table latin = run_design(here, "kind = \"latin-hypercube\"\ncount = 9\n" + kShort + kBoth);
  CHECK(stratified(latin.column(kStiffness), 10, 30));
  CHECK(stratified(latin.column(kDamping), 1, 2));
  const Table grid = run_design(here, "kind = \"grid\"\n" + kShort + "[design.vary]\n\"" + kStiffness +
                                          "\" = { from = 10, to = 1000, steps = 3, scale = \"log\" }\n\"" + kDamping +
                                          "\" = { from = 1, to = 2, steps = 2 }\n");
  CHECK(grid.rows.size() == 6);
  CHECK(grid.column(kDamping) == std::vector<double>{1, 2, 1, 2, 1, 2});
  const auto k = grid.column(kStiffness);
  CHECK(k[0] == 10);
  CHECK(k[2] == Approx(100));
  CHECK(k[4] == 1000);
}

TEST_CASE("study: samples of a distribution, the same for the same seed") {
  const WorkingDirectory here;
  const auto normal = [&](const std::string& seed) {
    return run_design(here, "kind = \"latin-hypercube\"\ncount = 40\n" + seed + kShort + "[design.vary]\n\"" +
                                kStiffness + "\" = { mean = 20, sigma = 2 }\n")
        .column(kStiffness);
  };
  const auto x = normal("");
  CHECK(x == normal("seed = 1\n"));
  CHECK(x != normal("seed = 2\n"));
  double mean = 0, square = 0;
  for (const double v : x) mean += v / 40;
  for (const double v : x) square += (v - mean) * (v - mean) / 39;
  // A stratified sample of 40: its mean is off by some sigma / 40, its deviation by a few percent of itself.
  CHECK(mean == Approx(20).margin(0.2));
  CHECK(std::sqrt(square) == Approx(2).margin(0.3));
}

TEST_CASE("study: psi, gradient and outputs of each point, and a page of them") {
  const WorkingDirectory here;
  const Table t = run_design(here, "kind = \"sobol\"\ncount = 3\ntask = \"gradient\"\n" + kBoth);
  for (std::size_t i = 0; i < 3; ++i) {
    const Json one = costate_json({"gradient", kPendulum, "--no-files", "--set", kStiffness + "=" + t.rows[i][3],
                                   "--set", kDamping + "=" + t.rows[i][4]},
                                  here.path());
    CHECK(t.column("psi")[i] == one.at("psi").get<double>());
    CHECK(t.column("dpsi/dc")[i] == one.at("gradient").at("c").get<double>());
  }
  const Table ends =
      run_design(here, "kind = \"sobol\"\ncount = 3\ntask = \"simulate\"\noutputs = [\"P.x\"]\n" + kBoth);
  const Json one = costate_json({"simulate", kPendulum, "--no-files", "--set", kStiffness + "=" + ends.rows[0][3],
                                 "--set", kDamping + "=" + ends.rows[0][4]},
                                here.path());
  CHECK(ends.column("P.x")[0] == one.at("terminal").at("P.x").get<double>());
  // The same command again keeps all of it.
  const Outcome again = run_costate({"study", "s.toml", "--output", "out"}, here.path());
  CHECK_THAT(again.err, Contains("3 of 3 runs are finished already"));
}

TEST_CASE("study: many starts of one optimization") {
  const WorkingDirectory here;
  const Table t =
      run_design(here, "kind = \"sobol\"\ncount = 3\n[design.vary]\n\"" + kDamping + "\" = { from = 0, to = 40 }\n");
  for (const double c : t.column("c.after")) CHECK(c == Approx(5.1073535).epsilon(1e-4));
  CHECK_THAT(file_text(here / "out/study.txt"), Contains("3 of 3 starts came there"));
}

TEST_CASE("study: mistakes in designs name their line") {
  const WorkingDirectory here;
  const auto complaint = [&](const std::string& rest) {
    write_text(here / "s.toml", design(rest));
    const Outcome o = run_costate({"study", "s.toml", "--output", "out"}, here.path());
    CHECK(o.status == 1);
    CHECK_THAT(o.err, Contains("s.toml:"));
    return o.err;
  };
  CHECK_THAT(complaint("kind = \"sobel\"\ncount = 3\n" + kBoth), Contains("grid, latin-hypercube, sobol, monte-carlo"));
  CHECK_THAT(complaint("kind = \"sobol\"\n" + kBoth), Contains("needs 'count'"));
  CHECK_THAT(complaint("kind = \"sobol\"\ncount = 3\n"), Contains("needs 'vary'"));
  CHECK_THAT(complaint("kind = \"grid\"\n" + kBoth), Contains("needs 'steps'"));
  CHECK_THAT(
      complaint("kind = \"grid\"\n[design.vary]\n\"" + kStiffness + "\" = { from = 1, to = 2, steps = 400 }\n\"" +
                kDamping + "\" = { from = 1, to = 2, steps = 300 }\n"),
      Contains("has 120000 points"));
  CHECK_THAT(complaint("kind = \"sobol\"\ncount = 2.5\n" + kBoth), Contains("must be an integer from 1"));
  CHECK_THAT(complaint("kind = \"sobol\"\ncount = 2\n[design.vary]\n\"no.such\" = { from = 1, to = 2 }\n"),
             Contains("no.such"));
  CHECK_THAT(complaint("kind = \"sobol\"\ncount = 2\n[design.vary]\n\"" + kStiffness +
                       "\" = { from = -1, to = 2, scale = \"log\" }\n"),
             Contains("have one sign"));
  CHECK(here.entries() == std::vector<std::string>{"s.toml"});
}
