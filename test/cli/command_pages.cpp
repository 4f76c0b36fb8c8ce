// The pages of fit, sweep, modes, equilibrium, check, compare, regress and explain: whole, self-contained, with the
// numbers of the summary; and targets and measured samples beside the outputs that they are of.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "five_bar.h"
#include "process.h"
#include "support/markup.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kIdentified = COSTATE_MODELS_DIR "/identification/pendulum.toml";

std::string command_page(const std::filesystem::path& path) {
  const std::string page = file_text(path);
  REQUIRE_FALSE(page.empty());
  CHECK(xml_fault(page).empty());
  CHECK(foreign_references(page).empty());
  CHECK(page.size() < 6'000'000);
  return page;
}

std::vector<std::string> row_cells(const std::string& row) {
  std::vector<std::string> cells;
  for (const auto& cell : all_between(row, "<td", "</td>")) cells.push_back(cell.substr(cell.find('>') + 1));
  return cells;
}

/// The cells of the rows of a table that begin with this cell.
std::vector<std::vector<std::string>> rows_beginning(const std::string& page, const std::string& first) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& row : all_between(page, "<tr>", "</tr>"))
    if (auto cells = row_cells(row); !cells.empty() && cells[0] == first) rows.push_back(std::move(cells));
  return rows;
}

std::string svg_named(const std::string& page, const std::string& title) {
  for (const auto& svg : all_between(page, "<svg ", "</svg>"))
    if (svg.find("data-across=") != std::string::npos && all_between(svg, "<title>", "</title>").at(0) == title)
      return svg;
  FAIL("no plot " << title);
  return {};
}

/// Of the axis of a plot, from its attribute: the value at a pixel.
double axis_value(const std::string& svg, const char* axis, double pixel) {
  std::istringstream in(all_between(svg, std::string(axis) + "=\"", "\"").at(0));
  double from = 0, to = 0, low = 0, high = 0;
  in >> from >> to >> low >> high;
  return low + (high - low) * (pixel - from) / (to - from);
}

/// The dots among a plot's curves.
ReadCurve drawn_dots(const std::string& svg) {
  ReadCurve dots;
  const std::string curves = all_between(svg, "<g class=\"curves\">", "</g>").at(0);
  for (const auto& dot : all_between(curves, "<circle ", ">")) {
    dots.x.push_back(axis_value(svg, "data-across", std::stod(all_between(dot, "cx=\"", "\"").at(0))));
    dots.y.push_back(axis_value(svg, "data-up", std::stod(all_between(dot, "cy=\"", "\"").at(0))));
  }
  return dots;
}

}  // namespace

TEST_CASE("fit page: parameters, what the data tell, samples beside the fitted motion, residuals") {
  const WorkingDirectory here;
  const Json j = costate_json({"fit", kIdentified, "--output", "out"}, here.path());
  const std::string page = command_page(here / "out/fit.html");
  for (const auto& [name, p] : j.at("parameters").items()) {
    const auto rows = rows_beginning(page, name);
    REQUIRE(rows.size() == 2);                                                             // and in the correlation
    CHECK(std::stod(rows[0].at(2)) == Approx(p.at("value").get<double>()).epsilon(1e-7));  // eight digits
    CHECK(std::stod(rows[0].at(3)) == Approx(p.at("standard_error").get<double>()).epsilon(5e-3));
  }
  CHECK(std::stod(rows_beginning(page, "length")[1].at(2)) ==
        Approx(j.at("correlation").at(0).at(1).get<double>()).margin(6e-4));
  // The samples are those of the file, where the picture can tell: a tenth of a pixel of some 200 is printed.
  const std::string plot = svg_named(page, "deflection [rad] over time [s]");
  CHECK_THAT(plot, Contains(">measured</text>") && Contains(">simulated</text>"));
  const ReadCurve dots = drawn_dots(plot);
  REQUIRE(dots.x.size() == 201);
  const ReadCurve fitted = read_plot(plot).curves.at(0);
  for (std::size_t k = 0; k < dots.x.size(); ++k) {
    std::size_t near = 0;
    for (std::size_t i = 0; i < fitted.x.size(); ++i)
      if (std::abs(fitted.x[i] - dots.x[k]) < std::abs(fitted.x[near] - dots.x[k])) near = i;
    // Five sigmas of half a degree; at 3 rad/s at most, half of a hundredth of the run's 5 s between points, and
    // pixels.
    CHECK(std::abs(fitted.y[near] - dots.y[k]) < 5 * 0.00873 + 3 * 0.01 + 0.01);
  }
  // The residuals' mean square is what the summary says.
  const ReadCurve residuals = drawn_dots(svg_named(page, "deflection: residual [sigma] over time [s]"));
  REQUIRE(residuals.y.size() == 201);
  double sum = 0;
  for (const double r : residuals.y) sum += r * r;
  CHECK(std::sqrt(sum / 201) == Approx(j.at("data").at(0).at("rms").get<double>()).epsilon(0.01));
  // What is not identified is said, and nothing is written that was not asked for.
  costate_json({"fit", kIdentified, "--parameters", "mass.bob.mass_kg,damping,length,released", "--output", "loose"},
               here.path());
  CHECK_THAT(command_page(here / "loose/fit.html"),
             Contains("are not identified") && Contains("<td>not identified</td>"));
  const auto before = here.entries();
  CHECK(run_costate({"fit", kIdentified, "--no-files"}, here.path()).status == 0);
  CHECK(here.entries() == before);
  const Outcome text = run_costate({"fit", kIdentified, "--output", "out", "--verbose"}, here.path());
  CHECK_THAT(text.out, Contains("report: out/fit.html"));
}

TEST_CASE("report: laws of time, outputs and targets of the end are drawn") {
  const WorkingDirectory here;
  std::string scene = file_text(kFiveBar);
  const std::string constant = "output = \"P2.x\"\ntarget = 0.5\n";
  REQUIRE(scene.find(constant) != std::string::npos);
  scene.replace(scene.find(constant), constant.size(), R"(output = "P2.x"
target = { kind = "sine", mean = 0.4, amplitude = 0.2, angular_frequency_rad_per_s = 3, phase_rad = 0.5 }

[[cost.running]]
kind = "square"
output = "P1.x"
target_output = "P3.x"

[[cost.terminal]]
kind = "square"
output = "P1.y"
target = -1.25
)");
  write_text(here / "scene.toml", scene);
  costate_json({"simulate", "scene.toml", "--report", "--output", "out"}, here.path());
  const std::string page = command_page(here / "out/simulate.html");
  const auto law = read_plot(svg_named(page, "P2.x [m] over time [s]")).curves;
  REQUIRE(law.size() == 2);
  for (std::size_t k = 0; k < law[1].x.size(); ++k)  // a pixel of 200 or so is half a hundredth
    CHECK(law[1].y[k] == Approx(0.4 + 0.2 * std::sin(3 * law[1].x[k] + 0.5)).margin(0.02));
  const auto other = read_plot(svg_named(page, "P1.x [m] over time [s]")).curves;
  const auto of = read_plot(svg_named(page, "P3.x [m] over time [s]")).curves;
  REQUIRE(other.size() == 2);
  REQUIRE(of.size() == 1);
  for (std::size_t k = 0; k < of[0].y.size(); ++k) CHECK(other[1].y[k] == Approx(of[0].y[k]).margin(0.03));
  CHECK_THAT(page, Contains(">target P3.x</text>") && Contains(">target at the end</text>"));
  const ReadCurve end = drawn_dots(svg_named(page, "P1.y [m] over time [s]"));
  REQUIRE(end.x.size() == 1);
  CHECK(end.x[0] == Approx(5).margin(0.02));
  CHECK(end.y[0] == Approx(-1.25).margin(0.02));
}

TEST_CASE("sweep page: outputs over the coordinate, and where it stopped") {
  const WorkingDirectory here;
  const Json j = costate_json({"sweep", kFiveBar, "--coordinate", "P1.x", "--from", "-0.9", "--to", "-0.5", "--count",
                               "5", "--hold", "P3.x", "--outputs", "P1.y,S1.force", "--output", "out"},
                              here.path());
  const std::string page = command_page(here / "out/sweep.html");
  const ReadCurve curve = read_plot(svg_named(page, "P1.y [m] over P1.x [m]")).curves.at(0);
  REQUIRE(curve.x.size() == 5);
  for (std::size_t k = 0; k < 5; ++k) {
    CHECK(curve.x[k] == Approx(j.at("values").at(k).get<double>()).margin(2e-3));
    CHECK(curve.y[k] == Approx(j.at("outputs").at("P1.y").at(k).get<double>()).margin(2e-3));
  }
  const auto row = rows_beginning(page, "-0.9");
  REQUIRE(row.size() == 1);
  CHECK(std::stod(row[0].at(2)) == Approx(j.at("outputs").at("S1.force").at(0).get<double>()).epsilon(1e-5));
  costate_json({"sweep", kFiveBar, "--coordinate", "P1.x", "--from", "-1", "--to", "-1.6", "--count", "7", "--hold",
                "none", "--output", "locked"},
               here.path(), 1);
  CHECK_THAT(command_page(here / "locked/sweep.html"), Contains("<p class=\"strong\">Stopped: "));
}

TEST_CASE("pages of modes and equilibrium: the numbers of the text, roots and a drawing, in a folder alone") {
  const WorkingDirectory here;
  const Json modes = costate_json({"modes", kFiveBar, "--equilibrium", "--output", "out"}, here.path());
  const std::string page = command_page(here / "out/modes.html");
  const ReadCurve roots = drawn_dots(svg_named(page, "imaginary [1/s] over real [1/s]"));
  REQUIRE(roots.y.size() == 4);  // two pairs
  for (std::size_t k = 0; k < 2; ++k) {
    const Json& mode = modes.at("modes").at(k);
    CHECK(roots.y[2 * k] == Approx(mode.at("imaginary_per_s").get<double>()).margin(0.03));
    CHECK(roots.y[2 * k + 1] == Approx(-roots.y[2 * k]).margin(0.06));
    const auto rows = rows_beginning(page, std::to_string(k + 1));
    REQUIRE(rows.size() == 1);
    CHECK(std::stod(rows[0].at(1)) == Approx(mode.at("frequency_Hz").get<double>()).epsilon(1e-7));
  }
  const Json rest =
      costate_json({"equilibrium", kFiveBar, "--derivatives", "--outputs", "P2.y", "--output", "out"}, here.path());
  const std::string still = command_page(here / "out/equilibrium.html");
  CHECK(std::stod(rows_beginning(still, "P2.y").at(0).at(1)) ==
        Approx(rest.at("positions").at("P2.y").get<double>()).epsilon(1e-9));
  CHECK(std::stod(rows_beginning(still, "L01").at(0).at(1)) ==
        Approx(rest.at("derivatives").at("P2.y").at("L01").get<double>()).epsilon(1e-9));
  CHECK_THAT(still, Contains(">P2</text>"));
  CHECK_THAT(run_costate({"modes", kFiveBar, "--output", "out"}, here.path()).out, Contains("report: out/modes.html"));
  const auto before = here.entries();
  for (const char* command : {"modes", "equilibrium"})
    CHECK(run_costate({command, kFiveBar, "--output", "out", "--no-files"}, here.path()).status == 0);
  CHECK(run_costate({"modes", kFiveBar}, here.path()).status == 0);
  CHECK(here.entries() == before);
}

TEST_CASE("check page: every row, and the verdict of the text") {
  const WorkingDirectory here;
  const std::vector<std::string> words = {
      "check",    kFiveBar, "--formulations", "index1,baumgarte", "--methods", "idas-forward,idas-adjoint",
      "--output", "out"};
  const Json j = costate_json(words, here.path());
  const std::string page = command_page(here / "out/check.html");
  CHECK_THAT(page, Contains("all agree within what the tolerances allow"));
  for (const Json& r : j.at("rows")) {
    const auto rows = rows_beginning(page, r.at("formulation").get<std::string>());
    const auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& c) { return c.at(1) == r.at("method"); });
    REQUIRE(row != rows.end());
    CHECK(row->at(2) == r.at("integrator"));
    CHECK(row->at(3) == r.at("status"));
    CHECK(std::stod(row->at(4)) == Approx(r.at("psi").get<double>()).epsilon(1e-6));
    CHECK(std::stol(row->at(6)) == r.at("counters").at("steps").get<long>());
  }
  for (const Json& m : j.at("motions"))
    CHECK(page.find("<td>" + m.at("integrator").get<std::string>() + "</td>") != std::string::npos);
}

TEST_CASE("compare and explain pages: what the text says, and pictures") {
  const WorkingDirectory here;
  write_text(here / "s.toml", file_text(kFiveBar));
  const std::vector<std::string> words = {
      "compare", "s.toml", "s.toml", "--set-a", "spring.S1.stiffness_N_per_m=101", "--no-gradient", "--output", "out"};
  const Json j = costate_json(words, here.path());
  const std::string page = command_page(here / "out/compare.html");
  double largest = 0;
  const ReadPlot apart = read_plot(svg_named(page, "P2.x [m], A - B over time [s]"));
  for (const double y : apart.curves.at(0).y) largest = std::max(largest, std::abs(y));
  CHECK(largest == Approx(j.at("outputs").at(0).at("largest").get<double>()).epsilon(0.05));
  CHECK_THAT(page, Contains("largest diff."));
  const Json explained = costate_json({"explain", kFiveBar, "--output", "out"}, here.path());
  const std::string built = command_page(here / "out/explain.html");
  for (const Json& kind : explained.at("kinds"))
    CHECK_THAT(built, Contains(">" + kind.at("kind").get<std::string>() + "</text>"));
  CHECK_THAT(built, Contains("degrees of freedom") && Contains("the rest"));
}

TEST_CASE("regress page: what moved, first") {
  const WorkingDirectory here;
  write_text(here / "s.toml", file_text(kFiveBar));
  std::filesystem::create_directory(here / "b");
  write_text(here / "b/one.json", R"({"scene": "../s.toml", "command": "simulate", "quantities": {"psi": {}}})");
  CHECK(run_costate({"regress", "b", "--update", "--output", "out"}, here.path()).status == 0);
  CHECK(rows_beginning(command_page(here / "out/regress.html"), "one").at(0).at(6) == "updated");
  write_text(here / "s.toml", file_text(kFiveBar) + "\n");
  std::string heavier = file_text(kFiveBar);
  heavier.replace(heavier.find("mass_kg = 1"), 11, "mass_kg = 1.01");
  write_text(here / "s.toml", heavier);
  const Json j = costate_json({"regress", "b", "--output", "out"}, here.path(), 1);
  const std::string page = command_page(here / "out/regress.html");
  const auto rows = rows_beginning(page, "one");
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].at(6) == "MOVED");
  CHECK(std::stod(rows[0].at(3)) == Approx(j.at("cases").at(0).at("quantities").at(0).at("found").get<double>()));
  CHECK(rows[1].at(1) == "moved");
  CHECK_THAT(page, Contains("1 baseline: 1 moved, 0 failed"));
}
