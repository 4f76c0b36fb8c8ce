// The page that costate optimize leaves for a person, and costate simulate --report: whole, self-contained, and showing
// what the files beside it hold.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <optional>

#include "costate/record/hdf5_file.h"
#include "five_bar.h"
#include "process.h"
#include "support/markup.h"

using Catch::Matchers::Contains;
using costate::test::all_between;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::foreign_references;
using costate::test::kFiveBar;
using costate::test::Process;
using costate::test::read_plot;
using costate::test::ReadCurve;
using costate::test::ReadPlot;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using costate::test::xml_fault;
using Json = nlohmann::json;

namespace {

/// The page's text after the checks that hold for all of them.
std::string page_at(const std::filesystem::path& path) {
  const std::string page = file_text(path);
  REQUIRE_FALSE(page.empty());
  CHECK(xml_fault(page).empty());
  CHECK(page.rfind("<!DOCTYPE html>", 0) == 0);
  CHECK(foreign_references(page).empty());
  CHECK(page.size() < 6'000'000);
  return page;
}

/// Of its drawings those that are plots; one of the motion is there, too, for readers without scripts.
std::vector<std::string> plots_of(const std::string& page) {
  auto all = all_between(page, "<svg ", "</svg>");
  std::erase_if(all, [](const std::string& svg) { return svg.find("data-across=") == std::string::npos; });
  return all;
}

/// The plot whose title begins so.
ReadPlot plot_named(const std::string& page, const std::string& title, bool logarithmic = false) {
  for (const auto& svg : plots_of(page))
    if (all_between(svg, "<title>", "</title>").at(0).rfind(title, 0) == 0) return read_plot(svg, logarithmic);
  FAIL("no plot " << title);
  return {};
}

/// The cells of the row of a table that begins with this cell.
std::vector<std::string> row_of(const std::string& page, const std::string& first) {
  for (const auto& row : all_between(page, "<tr>", "</tr>")) {
    std::vector<std::string> cells;
    for (const auto& cell : all_between(row, "<td", "</td>")) cells.push_back(cell.substr(cell.find('>') + 1));
    if (!cells.empty() && cells[0] == first) return cells;
  }
  FAIL("no row " << first);
  return {};
}

/// A curve of the page against a column of a file: the same at the same times within what a pixel can show.
void check_curve(const ReadCurve& curve, const std::filesystem::path& file, const std::string& group,
                 const std::string& name, double range) {
  const auto table = costate::read_hdf5(file);
  const auto* column = table.find(group, name);
  REQUIRE(column != nullptr);
  REQUIRE(curve.x.size() == table.time_s.size());
  double worst = 0;
  for (std::size_t k = 0; k < curve.x.size(); ++k) {
    CHECK(std::abs(curve.x[k] - table.time_s[k]) < 5 * 2e-3);
    worst = std::max(worst, std::abs(curve.y[k] - column->values[k]));
  }
  CHECK(worst < 5e-3 * range);  // half a unit of the last digit printed of 190 pixels, and that of the ticks
}

}  // namespace

TEST_CASE("optimize: the report says what the summary says") {
  const WorkingDirectory here;
  const Json j = costate_json({"optimize", kFiveBar, "--output", "out"}, here.path());
  const std::string page = page_at(here / "out/report.html");
  CHECK_THAT(page, Contains("<h1>Five-bar mechanism with two springs</h1>"));
  CHECK_THAT(page, Contains("psi went from 0.7268") && Contains("It fell by 0.7268") && Contains("100 %"));
  CHECK_THAT(page,
             Contains("stop value") && Contains("idas-adjoint") && Contains("lbfgs") && Contains("index1 on idas"));
  CHECK_THAT(page, Contains(j.at("certificate").at("verdict").get<std::string>()));
  const auto row = row_of(page, "L01");
  CHECK(std::stod(row.at(1)) == Approx(std::hypot(2, 1)).epsilon(1e-5));
  CHECK(std::stod(row.at(2)) == Approx(costate::test::kOptimalL01).epsilon(1e-5));
  CHECK(row.at(4) == "1");
  CHECK(row.at(5) == "4");
  CHECK(row.at(6).empty());
  CHECK(row.back() == "spring.S1.natural_length_m");
  // psi over the evaluations, and each parameter over its scale.
  const auto psi = plot_named(page, "psi", true).curves.at(0);
  const Json& evaluations = j.at("evaluations");
  REQUIRE(psi.y.size() == evaluations.size());
  for (std::size_t i = 0; i < psi.y.size(); ++i) {
    CHECK(psi.x[i] == Approx(static_cast<double>(i + 1)).margin(0.05));
    CHECK(std::log10(psi.y[i]) == Approx(std::log10(evaluations.at(i).at("psi").get<double>())).margin(0.2));
  }
  const auto scaled = plot_named(page, "L01 / 2.23607").curves.at(0);
  for (std::size_t i = 0; i < scaled.y.size(); ++i)
    CHECK(scaled.y[i] ==
          Approx(evaluations.at(i).at("parameters").at("L01").get<double>() / std::hypot(2, 1)).margin(0.01));
}

TEST_CASE("optimize: the report shows the motion before and after, of the cost's outputs and those of [run]") {
  const WorkingDirectory here;
  costate_json({"optimize", kFiveBar, "--output", "out"}, here.path());
  const std::string page = page_at(here / "out/report.html");
  const struct {
    const char *title, *group, *name;
    double range;
    std::optional<double> target = {};
  } plots[] = {{"P2.x [m]", "coordinates", "P2.x", 0.75, 0.5},
               {"P2.y [m]", "coordinates", "P2.y", 0.55, -2},
               {"S1.force [N]", "outputs", "S1.force", 27},
               {"S2.force [N]", "outputs", "S2.force", 50},
               {"energy.total [J]", "outputs", "energy.total", 5}};
  CHECK(plots_of(page).size() == 3 + std::size(plots));
  for (const auto& p : plots) {
    INFO(p.title);
    const ReadPlot read = plot_named(page, p.title);
    REQUIRE(read.curves.size() == (p.target ? 3 : 2));
    if (p.target)  // beside what it is a target of, once, though both motions have it
      for (const double y : read.curves[2].y) CHECK(y == Approx(*p.target).margin(5e-3 * p.range));
    check_curve(read.curves[0], here / "out/before.h5", p.group, p.name, p.range);
    check_curve(read.curves[1], here / "out/after.h5", p.group, p.name, p.range);
  }
}

TEST_CASE("optimize: active bounds and constraints in the report") {
  const WorkingDirectory here;
  write_text(here / "scene.toml", file_text(kFiveBar) + R"(
[[optimize.constraint]]
name = "impulse"
upper = 60

[[optimize.constraint.running]]
kind = "value"
output = "S1.force"
weight = -1
)");
  const Json j = costate_json(
      {"optimize", "scene.toml", "--algorithm", "slsqp", "--set", "parameter.L02.lower=1.9", "--output", "out"},
      here.path());
  const std::string page = page_at(here / "out/report.html");
  const bool active = j.at("bounds_active") == Json({"L02"});
  CHECK(row_of(page, "L02").at(6) == (active ? "at lower" : ""));
  CHECK(row_of(page, "L01").at(6).empty());
  const auto row = row_of(page, "impulse");
  CHECK(row.at(3) == "60");
  // The constraint's own cost: its value in the summary is the excess over `upper`.
  const Json& best = j.at("evaluations").at(j.at("best_evaluation").get<std::size_t>() - 1);
  CHECK(std::stod(row.at(2)) == Approx(60 + best.at("constraints").at("impulse").get<double>()).epsilon(1e-5));

  costate_json({"optimize", kFiveBar, "--set", "parameter.L02.lower=1.9", "--output", "bound"}, here.path());
  const std::string bound = page_at(here / "bound/report.html");
  CHECK(row_of(bound, "L02").at(6) == "at lower");
  const ReadPlot path = plot_named(bound, "L02 / 2.06155");  // with the bound as a line of its own
  REQUIRE(path.curves.size() == 2);
  for (const double y : path.curves[0].y) CHECK(y == Approx(1.9 / std::hypot(0.5, 2)).margin(2e-3));
  CHECK_THAT(bound, Contains(">lower bound</text>"));
}

TEST_CASE("optimize: a run that a limit ended says so in its report") {
  const WorkingDirectory here;
  costate_json({"optimize", kFiveBar, "--max-evaluations", "2", "--no-certificate", "--output", "out"}, here.path());
  const std::string page = page_at(here / "out/report.html");
  CHECK_THAT(page, Contains("before it converged") && !Contains("Certificate"));
}

TEST_CASE("report: left out where it is not wanted") {
  const WorkingDirectory here;
  costate_json({"optimize", kFiveBar, "--no-report", "--output", "out"}, here.path());
  CHECK_FALSE(std::filesystem::exists(here / "out/report.html"));
  CHECK(std::filesystem::exists(here / "out/after.h5"));
  costate_json({"simulate", kFiveBar, "--output", "sim"}, here.path());
  CHECK_FALSE(std::filesystem::exists(here / "sim/simulate.html"));
  const Json j = costate_json({"simulate", kFiveBar, "--report", "--no-files"}, here.path(), 1);
  CHECK_THAT(j.at("error").get<std::string>(), Contains("--report") && Contains("--no-files"));
}

TEST_CASE("simulate --report: the motion alone") {
  const WorkingDirectory here;
  const Json j = costate_json({"simulate", kFiveBar, "--report", "--output", "out"}, here.path());
  CHECK(j.at("files").back() == "out/simulate.html");
  const std::string page = page_at(here / "out/simulate.html");
  CHECK(plots_of(page).size() == 5);
  const ReadPlot read = plot_named(page, "P2.x [m]");
  REQUIRE(read.curves.size() == 2);
  CHECK(std::abs(read.curves[1].y.front() - 0.5) < 5e-3 * 0.75);
  CHECK_THAT(page, Contains(">target</text>") && Contains(">simulated</text>"));
  check_curve(read.curves[0], here / "out/trajectory.h5", "coordinates", "P2.x", 0.75);
}

TEST_CASE("report: names are escaped, whatever they are") {
  const WorkingDirectory here;
  const std::string name = "f\xfc<&>nf.toml";
  write_text(here / name, file_text(kFiveBar));
  costate_json({"simulate", name, "--report", "--output", "out", "--set", R"(title="<b>1 & 2</b> 'x'")"}, here.path());
  const std::string page = page_at(here / "out/simulate.html");
  CHECK_THAT(page, Contains("<h1>&lt;b&gt;1 &amp; 2&lt;/b&gt; &#39;x&#39;</h1>") && Contains("&lt;&amp;&gt;nf.toml"));
}

TEST_CASE("report: an interrupted run leaves nothing of an earlier one") {
  const WorkingDirectory here;
  costate_json({"optimize", kFiveBar, "--output", "out"}, here.path());
  const std::string page = page_at(here / "out/report.html");
  std::filesystem::remove(here / "out/evaluations.jsonl");
  Process process(COSTATE_EXECUTABLE, {"optimize", kFiveBar, "--rtol", "1e-12", "--output", "out"}, here.path());
  REQUIRE(process.wait_until([&] {
    const std::string journal = file_text(here / "out/evaluations.jsonl");
    return std::count(journal.begin(), journal.end(), '\n') >= 2;
  }));
  CHECK_FALSE(std::filesystem::exists(here / "out/report.html"));
  process.send(SIGINT);
  CHECK(process.finish().status == 130);
  CHECK(here.entries() == std::vector<std::string>{"out", "out/evaluations.jsonl", "out/optimize.json",
                                                   "out/optimized.toml", "out/report.html"});
  CHECK(page_at(here / "out/report.html") != page);
}

TEST_CASE("report: what the optimizer and the certificate say does not contradict itself") {
  const WorkingDirectory here;
  // Stopped by a limit at a point that is a minimum: the optimum, from which it begins.
  costate_json({"optimize", kFiveBar, "--output", "first"}, here.path());
  const Json j = costate_json(
      {"optimize", "first/optimized.toml", "--max-evaluations", "1", "--stop-value=-1", "--output", "second"},
      here.path());
  CHECK(j.at("converged") == false);
  REQUIRE_THAT(j.at("certificate").at("verdict").get<std::string>(), Contains("strict local minimum"));
  const std::string page = page_at(here / "second/report.html");
  CHECK_THAT(page, Contains("the certificate below finds a minimum") && !Contains("not an optimum"));
}
