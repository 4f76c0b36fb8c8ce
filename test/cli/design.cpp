// costate study with designs: where their points lie, what is made of them, that they resume like other runs.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "csv_table.h"
#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kPendulum = COSTATE_MODELS_DIR "/damped_pendulum/damped_pendulum.toml";
const std::string kStiffness = "spring.strut.stiffness_N_per_m", kDamping = "spring.strut.damping_N_s_per_m";

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
  CHECK_THAT(complaint("kind = \"sobol\"\ncount = 3\ntask = \"simulate\"\noutputs = [\"P.z\"]\n" + kBoth),
             Contains("'P.z'"));
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

namespace {

/// psi is a formula of two numbers, whatever the mechanism does.
std::string formula_scene(const std::string& formula) {
  return file_text(kPendulum) + "\n[output.f]\nformula = \"" + formula +
         "\"\nunit = \"1\"\na = 0.5\nb = 0.5\n[[cost.terminal]]\nkind = \"value\"\noutput = \"f\"\n";
}

Json sensitivity(const WorkingDirectory& here, const std::string& formula, const std::string& rest) {
  std::string scene = formula_scene(formula);
  const std::string running = "[[cost.running]]\nkind = \"square\"\noutput = \"P.x\"\n";
  REQUIRE(scene.find(running) != std::string::npos);
  scene.replace(scene.find(running), running.size(), "");
  write_text(here / "f.toml", scene);
  write_text(here / "s.toml", "[[design]]\nname = \"d\"\nscene = \"f.toml\"\noptions = { t_end = 0.001 }\n" + rest);
  const Json j = costate_json({"study", "s.toml", "--output", "out"}, here.path());
  CHECK(j.at("status") == "ok");
  CHECK(j.at("sensitivity") == Json::parse(file_text(here / "out/study.json")).at("sensitivity"));
  return j.at("sensitivity").at("d").at("psi");
}

}  // namespace

TEST_CASE("study: Sobol' indices of a function that is known, and their bounds from gradients") {
  const WorkingDirectory here;
  // f = a + 2 b + a b, a and b uniform in (-1, 1): of the variance 1/3 + 4/3 + 1/9.
  const Json s = sensitivity(here, "a + 2*b + a*b",
                             "kind = \"saltelli\"\ncount = 64\ntask = \"gradient\"\nparameters = [\"output.f.a\", "
                             "\"output.f.b\"]\n[design.vary]\n\"output.f.a\" = { from = -1, to = 1 }\n\"output.f.b\" = "
                             "{ from = -1, to = 1 }\n");
  CHECK(s.at("blocks") == 64);
  CHECK(s.at("variance").get<double>() == Approx(16.0 / 9).epsilon(0.05));
  // The standard errors are those of 64 points by chance; those of the sequence lie closer.
  const struct {
    const char *path, *index;
    double exact;
  } expected[] = {{"output.f.a", "first", 3.0 / 16},
                  {"output.f.b", "first", 12.0 / 16},
                  {"output.f.a", "total", 4.0 / 16},
                  {"output.f.b", "total", 13.0 / 16}};
  for (const auto& e : expected) {
    INFO(e.path << " " << e.index);
    const double error = s.at(std::string(e.index) + "_error").at(e.path);
    CHECK((error > 0 && error < 0.3));
    CHECK(std::abs(s.at(e.index).at(e.path).get<double>() - e.exact) < 2 * error);
  }
  // C E((1 + b)^2)/V and C E((2 + a)^2)/V with C = 4/pi^2.
  const double c = 4 / (M_PI * M_PI) / (16.0 / 9);
  CHECK(s.at("total_bound").at("output.f.a").get<double>() == Approx(c * 4 / 3).epsilon(0.1));
  CHECK(s.at("total_bound").at("output.f.b").get<double>() == Approx(c * 13 / 3).epsilon(0.1));
  // Of a block's four points two and two share a number: its mean of (slope^2 - bound f^2)/V counts as one. By a
  // million blocks in numpy it varies by 0.2439 for a and 0.6928 for b.
  CHECK(s.at("total_bound_error").at("output.f.a").get<double>() == Approx(0.2439 / 8).epsilon(0.2));
  CHECK(s.at("total_bound_error").at("output.f.b").get<double>() == Approx(0.6928 / 8).epsilon(0.2));
  CHECK_THAT(file_text(here / "out/study.txt"), Contains("of the variance of psi") && Contains("first-order"));
}

TEST_CASE("study: of a linear function of normal numbers the bounds are the indices") {
  const WorkingDirectory here;
  const Json s = sensitivity(here, "3*a + 4*b",
                             "kind = \"latin-hypercube\"\ncount = 40\ntask = \"gradient\"\nparameters = "
                             "[\"output.f.a\", \"output.f.b\"]\n[design.vary]\n\"output.f.a\" = { mean = 0, sigma = 1 "
                             "}\n\"output.f.b\" = { mean = 1, sigma = 1 }\n");
  const double a = s.at("total_bound").at("output.f.a"), b = s.at("total_bound").at("output.f.b");
  CHECK(a / b == Approx(9.0 / 16).epsilon(1e-9));  // slopes are constant
  // The estimated variance, and so the sum, is within its own standard error, sqrt(2/39), thrice.
  CHECK(a + b == Approx(1).margin(3 * std::sqrt(2.0 / 39)));
  CHECK_FALSE(s.contains("first"));
}

// Where the error left out that the variance is a sample's it was 0 here: "at most 0.68 +- 0" of what makes all of it.
TEST_CASE("study: a bound's error has that of the variance, and a grid has none") {
  const WorkingDirectory here;
  const std::string vary = "task = \"gradient\"\nparameters = [\"output.f.a\"]\n[design.vary]\n\"output.f.a\" = ";
  const Json s =
      sensitivity(here, "3*a + b", "kind = \"monte-carlo\"\ncount = 64\n" + vary + "{ mean = 0, sigma = 1 }\n");
  const double bound = s.at("total_bound").at("output.f.a"), error = s.at("total_bound_error").at("output.f.a");
  // The variance of 64 normal numbers is known to sqrt(2/64) of itself; that of its estimate, to a third.
  CHECK(error == Approx(bound * std::sqrt(2.0 / 64)).epsilon(0.5));
  CHECK(std::abs(bound - 1) < 4 * error);
  write_text(here / "g.toml",
             "[[design]]\nname = \"g\"\nscene = \"f.toml\"\noptions = { t_end = 0.001 }\nkind = "
             "\"grid\"\n" +
                 vary + "{ from = 0, to = 1, steps = 3 }\n");
  const Json grid = costate_json({"study", "g.toml", "--output", "grid"}, here.path());
  CHECK(grid.at("status") == "ok");
  CHECK((!grid.contains("sensitivity") || !grid.at("sensitivity").contains("g")));
}

TEST_CASE("study: a design of Saltelli's kind has its blocks, and its limits") {
  const WorkingDirectory here;
  const Table t = run_design(here, "kind = \"saltelli\"\ncount = 3\n" + kShort + kBoth);
  REQUIRE(t.rows.size() == 12);
  const auto x = t.column(kStiffness), y = t.column(kDamping);
  for (std::size_t block = 0; block < 12; block += 4) {
    CHECK(x[block + 2] == x[block + 1]);
    CHECK(y[block + 2] == y[block]);
    CHECK(x[block + 3] == x[block]);
    CHECK(y[block + 3] == y[block + 1]);
    // A block whose A is its B tells nothing.
    CHECK((x[block + 1] != x[block] || y[block + 1] != y[block]));
  }
  write_text(here / "s.toml", design("kind = \"saltelli\"\ncount = 50000\n" + kShort + kBoth));
  const Outcome o = run_costate({"study", "s.toml", "--output", "out"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("give fewer blocks"));
  for (const std::string kind : {"saltelli", "sobol"}) {
    write_text(here / "s.toml", design("kind = \"" + kind + "\"\ncount = 4\nseed = 3\n" + kShort + kBoth));
    const Outcome seeded = run_costate({"study", "s.toml", "--output", "out"}, here.path());
    CHECK(seeded.status == 1);
    CHECK_THAT(seeded.err, Contains("s.toml:") && Contains("'seed'") && Contains("leave it out"));
  }
}

TEST_CASE("study: a point that cannot be run is a failed run, the first one, too") {
  const WorkingDirectory here;
  const auto design = [&](const char* range) {
    write_text(here / "s.toml", std::string("[[design]]\nname = \"d\"\nscene = \"") + COSTATE_MODELS_DIR +
                                    "/damped_pendulum/damped_pendulum.toml\"\ntask = \"simulate\"\nkind = \"grid\"\n"
                                    "options = { t_end = 0.1 }\n[design.vary]\n"
                                    "\"spring.strut.stiffness_N_per_m\" = { " +
                                    range + ", steps = 2 }\n");
    return costate_json({"study", "s.toml", "--output", "out"}, here.path(), 1);
  };
  const Json j = design("from = -10, to = 20");
  CHECK(j.at("runs").at(0).at("status") == "failed");
  CHECK_THAT(j.at("runs").at(0).at("error").get<std::string>(), Contains("must not be negative"));
  CHECK(j.at("runs").at(1).at("status") == "ok");
  // Where none can be run the study cannot.
  CHECK_THAT(design("from = -10, to = -20").at("error").get<std::string>(),
             Contains("d.1") && Contains("must not be negative"));
}
