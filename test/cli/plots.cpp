// Plots of pages in a browser: drawn by Chart.js they say what was drawn, are read off and zoomed. Without Chromium, or
// Chart.js, these are passed over.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "browser.h"
#include "five_bar.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

constexpr const char* kCharts = R"js(
const charts = Array.from(document.querySelectorAll('.plot canvas'), c => Chart.getChart(c));
const over = name => charts.find(c => c.canvas.getAttribute('aria-label').startsWith(name));
const fire = (chart, type, x, y) => {  // at parts of the room of its curves
  const box = chart.canvas.getBoundingClientRect(), a = chart.chartArea;
  const at = {clientX: box.left + a.left + x * (a.right - a.left),
              clientY: box.top + a.top + (y === undefined ? 0.5 : y) * (a.bottom - a.top), bubbles: true};
  chart.canvas.dispatchEvent(type.startsWith('pointer') ? new PointerEvent(type, at) : new MouseEvent(type, at));
};
Element.prototype.setPointerCapture = () => {};  // of a pointer that there is not
const ticks = s => s.ticks.map(t => t.label);
const ink = chart => {  // pixels
  const c = chart.canvas, d = new Uint32Array(c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer);
  return d.filter(p => p >>> 24 > 0).length;
};
const told_at = chart => [].concat(chart.tooltip.title, ...chart.tooltip.body.map(b => b.lines));
)js";

/// Of "P2.x 0.51234 at 3.02": the number that ends it, or stands before the "at".
double number_of(std::string line) {
  line = line.substr(0, line.find(" at "));
  return std::stod(line.substr(line.rfind(' ')));
}

}  // namespace

TEST_CASE("plots: what is under the pointer is read off, a span is zoomed, a click leads the motion there") {
  if (!no_chart().empty()) {
    WARN("skipped: " << no_chart());
    return;
  }
  const WorkingDirectory here;
  const Json j = costate_json({"optimize", kFiveBar, "--output", "out"}, here.path());
  const Json told = told_by(here, "out/report.html", std::string(kCharts) + R"js(
const plot = over('P2.x'), other = over('P2.y'), descent = over('psi'), slider = document.getElementById('time');
told.count = [charts.length, document.querySelectorAll('svg[data-across]').length];
told.hidden = Array.from(document.querySelectorAll('svg[data-across]'), s => getComputedStyle(s).display);
told.ink = Math.min(...charts.map(ink));
told.psi = descent.data.datasets[0].data;
told.psi_ticks = ticks(descent.scales.y);
told.first = ticks(plot.scales.x);
told.names = plot.legend.legendItems.map(i => i.text);
plot.options.plugins.legend.onClick(null, plot.legend.legendItems[0]);
told.off = plot.data.datasets.filter((d, i) => !plot.isDatasetVisible(i)).map(d => d.label);
plot.options.plugins.legend.onClick(null, plot.legend.legendItems[0]);
fire(plot, 'pointerdown', 0.2);
fire(plot, 'pointermove', 0.4);
told.span = plot.canvas.parentElement.querySelector('.span').offsetWidth / (plot.chartArea.right - plot.chartArea.left);
fire(plot, 'pointerup', 0.4);
told.zoomed = plot.canvas.parentElement.dataset.zoomed;
told.ticks = ticks(plot.scales.x);
const seen = plot.data.datasets.flatMap(d => d.data).filter(p => p.x >= plot.scales.x.min && p.x <= plot.scales.x.max).map(p => p.y);
told.room = [(plot.scales.y.max - plot.scales.y.min) / (Math.max(...seen) - Math.min(...seen))];
fire(plot, 'dblclick', 0.5);
told.all = ticks(plot.scales.x);
fire(other, 'mousemove', 0.5);
fire(plot, 'mousemove', 0.31);
const later = () => {
  told.reading = told_at(other);
  told.reading_there = told_at(plot);
  if (!slider) return;
  document.getElementById('play').click();
  fire(plot, 'pointerdown', 0.6);
  fire(plot, 'pointerup', 0.6);
  told.sought = Number(slider.value);
  const now = other.canvas.parentElement.querySelector('.now');
  told.line = other.scales.x.getValueForPixel(parseFloat(now.style.left));
  told.fetched = performance.getEntriesByType('resource').map(e => e.name);
};)js");
  REQUIRE(told.at("count")[0] == told.at("count")[1]);
  for (const std::string display : told.at("hidden")) CHECK(display == "none");
  CHECK(told.at("ink") > 1000);
  // The descent: every evaluation, on a logarithmic axis, to the digits that its pixels bear.
  const Json& psi = told.at("psi");
  REQUIRE(psi.size() == j.at("evaluations").size());
  CHECK(psi.front().at("x").get<double>() == Approx(1).epsilon(1e-4));
  CHECK(psi.front().at("y").get<double>() == Approx(0.72687746).epsilon(3e-4));
  REQUIRE(told.at("psi_ticks").size() > 2);
  for (const std::string label : told.at("psi_ticks")) {
    if (label.empty()) continue;
    const double decades = std::log10(std::stod(label));
    CHECK(decades == Approx(std::round(decades)).margin(1e-9));
  }
  CHECK(told.at("names") == Json({"before", "after", "target"}));
  REQUIRE(told.at("off").size() == 1);
  CHECK(told.at("off")[0] == "before");
  // The pixel of the pointer is whole where browsers round it: 1/500 of 5 s.
  CHECK(told.at("span").get<double>() == Approx(0.2).margin(0.005));
  const std::string zoomed = told.at("zoomed");
  CHECK(std::stod(zoomed) == Approx(1).margin(0.02));
  CHECK(std::stod(zoomed.substr(zoomed.find(' '))) == Approx(2).margin(0.02));
  REQUIRE(told.at("ticks").size() > 3);
  for (const std::string t : told.at("ticks")) CHECK((std::stod(t) >= 0.98 && std::stod(t) <= 2.02));
  CHECK(told.at("room")[0].get<double>() == Approx(1.08).margin(0.02));
  CHECK(told.at("all") == told.at("first"));
  CHECK(told.at("all").front() == "0");
  CHECK(told.at("all").back() == "5");
  for (const char* which : {"reading", "reading_there"}) {
    const Json& lines = told.at(which);
    INFO(lines);
    REQUIRE(lines.size() >= 3);
    const double t = number_of(lines[0]);
    CHECK(t == Approx(which == std::string("reading") ? 2.5 : 1.55).margin(0.02));
    CHECK_THAT(lines[1].get<std::string>(), Contains("before ") || Contains("after ") || Contains("target "));
  }
  if (has_three) {
    CHECK(told.at("sought").get<double>() == Approx(3).margin(0.02));
    CHECK(told.at("line").get<double>() == Approx(3).margin(0.02));
    CHECK(told.at("fetched").empty());
  }
}

TEST_CASE("plots: what can be read off are the samples that are in the files") {
  if (!no_chart().empty()) {
    WARN("skipped: " << no_chart());
    return;
  }
  const WorkingDirectory here;
  costate_json({"optimize", kFiveBar, "--output", "out", "--max-evaluations", "2"}, here.path());
  const Json told = told_by(here, "out/report.html", std::string(kCharts) + R"js(
told.data = over('P2.x').data.datasets.find(d => d.label === 'before').data;
const later = () => {};)js");
  // Pixels to a thousandth, of some 500 across and 200 up: 5 s and 0.75 m.
  std::istringstream table(file_text(here / "out/before.csv"));
  std::string line;
  std::getline(table, line);
  REQUIRE(line.rfind("time [s],coordinates/P1.x [m],coordinates/P1.y [m],coordinates/P2.x [m],", 0) == 0);
  std::size_t i = 0;
  for (; std::getline(table, line); ++i) {
    double t = 0, p1x = 0, p1y = 0, p2x = 0;
    REQUIRE(std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &t, &p1x, &p1y, &p2x) == 4);
    const Json& point = told.at("data").at(i);
    CHECK(point.at("x").get<double>() == Approx(t).margin(5 * 2e-6));
    CHECK(point.at("y").get<double>() == Approx(p2x).margin(0.75 * 5e-6));
  }
  CHECK(i == told.at("data").size());
#ifdef COSTATE_CHART_DIR
  const auto library = all_between(file_text(here / "out/report.html"), "<script id=\"chart\">", "</script>");
  REQUIRE(library.size() == 1);
  CHECK(library[0].find(file_text(std::string(COSTATE_CHART_DIR) + "/chart.min.js")) != std::string::npos);
  CHECK_THAT(library[0],
             Contains("Chart.js Contributors") && Contains("Jukka Kurkela") && Contains("shall be included in"));
#endif
}

TEST_CASE("plots: dots say which run they are, on axes that count and on logarithmic ones") {
  if (!no_chart().empty()) {
    WARN("skipped: " << no_chart());
    return;
  }
  const WorkingDirectory here;
  const std::string scene = COSTATE_MODELS_DIR "/damped_pendulum/damped_pendulum.toml";
  write_text(here / "s.toml", "[[design]]\nname = \"d\"\nscene = \"" + scene +
                                  "\"\ntask = \"simulate\"\nkind = \"sobol\"\ncount = 8\n[design.vary]\n"
                                  "\"spring.strut.damping_N_s_per_m\" = { from = 1, to = 9 }\n");
  const Json j = costate_json({"study", "s.toml", "--output", "out"}, here.path());
  const Json told = told_by(here, "out/report.html", std::string(kCharts) + R"js(
const plot = charts[0], set = plot.data.datasets[0], dot = plot.getDatasetMeta(0).data[3];
told.names = set.data.map(p => p.name);
told.values = set.data.map(p => p.y);
const box = plot.canvas.getBoundingClientRect();
plot.canvas.dispatchEvent(new MouseEvent('mousemove', {clientX: box.left + dot.x, clientY: box.top + dot.y, bubbles: true}));
const later = () => { told.reading = told_at(plot); };)js");
  REQUIRE(told.at("names").size() == 8);
  for (std::size_t i = 0; i < 8; ++i) {
    const auto run = std::find_if(j.at("runs").begin(), j.at("runs").end(), [&](const Json& r) {
      return told.at("names")[i].get<std::string>().find(r.at("name").get<std::string>()) != std::string::npos;
    });
    REQUIRE(run != j.at("runs").end());
    CHECK(told.at("values")[i].get<double>() == Approx(run->at("psi").get<double>()).epsilon(1e-4));
  }
  CHECK_THAT(told.at("reading").dump(), Contains(told.at("names")[3].get<std::string>()));
}
