// Tests of the plots in reports: read back from the picture, they show the numbers that were drawn.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/record/svg_plot.h"
#include "support/markup.h"

using costate::svg_of;
using costate::SvgCurve;
using costate::SvgPlot;
using costate::xml_escaped;
using costate::test::read_plot;
using costate::test::ReadPlot;
using costate::test::xml_fault;

namespace {

SvgPlot plot_of(std::vector<double> x, std::vector<double> y) {
  SvgPlot p;
  p.x_label = "time [s]";
  p.y_label = "P.x [m]";
  p.curves = {{"before", std::move(x), std::move(y), SvgCurve::Stroke::dark, false}};
  return p;
}

}  // namespace

TEST_CASE("svg plot: curves read back from the picture are those drawn", "[record]") {
  // Pixels are printed to 0.1 and ticks placed to 0.1: a value reads back to about 0.2 of the 190 pixels of an axis.
  // The ticks' labels hold for every size of number, also far from zero.
  for (const double scale : {1e-12, 1e-3, 1.0, 7e4, 3e9})
    for (const double offset : {0.0, 1.0, 50.0}) {
      INFO(scale << " " << offset);
      std::vector<double> x, y;
      for (int i = 0; i <= 100; ++i) {
        x.push_back(0.05 * i);
        y.push_back(scale * (offset + std::sin(x.back())));
      }
      const std::string svg = svg_of(plot_of(x, y));
      CHECK(xml_fault(svg).empty());
      const ReadPlot read = read_plot(svg);
      REQUIRE(read.curves.size() == 1);
      REQUIRE(read.curves[0].x.size() == x.size());
      for (std::size_t i = 0; i < x.size(); ++i) {
        CHECK(std::abs(read.curves[0].x[i] - x[i]) < 5 * 2e-3);
        CHECK(std::abs(read.curves[0].y[i] - y[i]) < scale * 2 * 3e-3);
      }
    }
}

TEST_CASE("svg plot: a logarithmic axis", "[record]") {
  SvgPlot p = plot_of({1, 2, 3, 4, 5}, {0.7, 2.5, 1e-3, 0, 4e-15});
  p.logarithmic = true;
  p.curves[0].y[3] = 1e-8;
  const ReadPlot read = read_plot(svg_of(p), true);
  REQUIRE(read.curves.size() == 1);
  for (std::size_t i = 0; i < 5; ++i) CHECK(read.curves[0].y[i] == Approx(p.curves[0].y[i]).epsilon(0.2));
  // What has no logarithm interrupts the line.
  p.curves[0].y = {1, 0.1, 0, 1e-2, 1e-4};
  CHECK(read_plot(svg_of(p), true).curves.size() == 2);
}

TEST_CASE("svg plot: many points are thinned, extremes kept", "[record]") {
  std::vector<double> x, y;
  for (int i = 0; i < 200'000; ++i) {
    x.push_back(1e-5 * i);
    y.push_back(std::sin(40 * x.back()));
  }
  y[123'456] = 5;  // a spike of one sample
  y[123'999] = -3;
  const std::string svg = svg_of(plot_of(x, y));
  CHECK(svg.size() < 60'000);
  const auto curve = read_plot(svg).curves.at(0);
  const auto [low, high] = std::minmax_element(curve.y.begin(), curve.y.end());
  CHECK(*high == Approx(5).margin(0.05));
  CHECK(*low == Approx(-3).margin(0.05));
}

TEST_CASE("svg plot: what has no shape is drawn all the same", "[record]") {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const auto& y : std::vector<std::vector<double>>{{3, 3, 3},
                                                        {0, 0, 0},
                                                        {nan, nan, nan},
                                                        {1, nan, 2},
                                                        {infinity, 1, 2},
                                                        {1e300, -1e300, 0},
                                                        {1e-320, 0, 0},
                                                        {}}) {
    const std::string svg = svg_of(plot_of(y.empty() ? std::vector<double>{} : std::vector<double>{0, 1, 2}, y));
    INFO(svg);
    CHECK(xml_fault(svg).empty());
    CHECK(svg.find("nan") == std::string::npos);
    CHECK(svg.find("inf") == std::string::npos);
  }
  // A constant far from zero, noisy by rounding, is a line and not noise.
  const auto flat = read_plot(svg_of(plot_of({0, 1, 2}, {2, 2 + 4e-16, 2}))).curves.at(0);
  for (const double v : flat.y) CHECK(v == Approx(2).margin(2e-3));
  CHECK_THROWS_AS(svg_of(plot_of({0, 1}, {1})), costate::Error);
}

TEST_CASE("svg plot: names are escaped", "[record]") {
  CHECK(xml_escaped("a<b> & \"c\" 'd'") == "a&lt;b&gt; &amp; &quot;c&quot; &#39;d&#39;");
  CHECK(xml_escaped("m\xc3\xbc \xe2\x82\xac \xf0\x9f\x9a\x97") == "m\xc3\xbc \xe2\x82\xac \xf0\x9f\x9a\x97");
  const std::string bad = "\xef\xbf\xbd";
  CHECK(xml_escaped("\xfc!") == bad + "!");
  CHECK(xml_escaped("\xc3") == bad);                      // cut off
  CHECK(xml_escaped("\xc0\xaf") == bad + bad);            // longer than need be
  CHECK(xml_escaped("\xed\xa0\x80") == bad + bad + bad);  // half a surrogate pair
  CHECK(xml_escaped(std::string("\x01\x1b\0x", 4)) == bad + bad + bad + "x");
  SvgPlot p = plot_of({0, 1}, {0, 1});
  p.y_label = "<&>";
  p.curves[0].name = "\"&\"";
  CHECK(xml_fault(svg_of(p)).empty());
  CHECK(read_plot(svg_of(p)).title == "&lt;&amp;&gt; over time [s]");
}
