// costate draw: what is named, where it stands on the page, and that every kind of element can be drawn.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <regex>
#include <vector>

#include "costate/scene/scene.h"
#include "costate/scene/scene_kind.h"
#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;

namespace {

const std::string models = COSTATE_MODELS_DIR;

std::string drawing(const std::string& scene, std::vector<std::string> options = {}) {
  const WorkingDirectory here;
  options.insert(options.begin(), {"draw", scene});
  const Outcome o = run_costate(options, here.path());
  INFO(o.err);
  REQUIRE(o.status == 0);
  return o.out;
}

/// Every tag is closed, in order; no character that XML would take for markup stands in a text.
void require_well_formed(const std::string& svg) {
  std::vector<std::string> open;
  static const std::regex tag(R"re(<(/?)(\w+)((?:\s+[\w:-]+="[^"<]*")*)\s*(/?)>)re");
  std::string rest;
  auto last = svg.cbegin();
  for (std::sregex_iterator i(svg.begin(), svg.end(), tag), end; i != end; ++i) {
    rest.append(last, svg.cbegin() + i->position());
    last = svg.cbegin() + i->position() + i->length();
    if (!(*i)[1].str().empty()) {
      REQUIRE_FALSE(open.empty());
      REQUIRE(open.back() == (*i)[2].str());
      open.pop_back();
    } else if ((*i)[4].str().empty()) {
      open.push_back((*i)[2].str());
    }
  }
  rest.append(last, svg.cend());
  REQUIRE(open.empty());
  REQUIRE(rest.find_first_of("<>") == std::string::npos);
  REQUIRE(svg.find("nan") == std::string::npos);
  REQUIRE(svg.find("inf") == std::string::npos);
}

/// The centres of small circles of points, in the order of the drawing.
std::vector<std::pair<double, double>> points(const std::string& svg) {
  static const std::regex circle(R"re(<circle cx="([-\d.]+)" cy="([-\d.]+)" r="3.6")re");
  std::vector<std::pair<double, double>> r;
  for (std::sregex_iterator i(svg.begin(), svg.end(), circle), end; i != end; ++i)
    r.emplace_back(std::stod((*i)[1]), std::stod((*i)[2]));
  return r;
}

}  // namespace

TEST_CASE("draw: the names of bodies, joints, forces and points") {
  const std::vector<std::pair<std::string, std::vector<std::string>>> expected = {
      {"five_bar/five_bar", {"A", "B", "P1", "P2", "P3", "A1", "B12", "B23", "B3B", "S1", "S2"}},
      {"car_axis/car_axis", {"axle", "track", "guide", "road", "left", "right", "PL", "PR"}},
      {"andrews/andrews", {"K1", "K7", "CD", "motor", "E6", "C"}},
      {"bricard/bricard", {"rod1", "rod5", "H0", "H5", "G0, P0_1", "out, P2_3"}},
      {"flyball_governor/flyball_governor", {"shaft", "slider", "ball1", "link2", "bearing", "guide", "hip1"}},
      {"heavy_top/heavy_top", {"top", "foot", "center"}}};
  for (const auto& [scene, names] : expected) {
    INFO(scene);
    const std::string svg = drawing(models + "/" + scene + ".toml");
    require_well_formed(svg);
    for (const auto& name : names) CHECK_THAT(svg, Contains(">" + name + "</text>"));
    const std::string bare = drawing(models + "/" + scene + ".toml", {"--no-names"});
    for (const auto& name : names) CHECK_THAT(bare, !Contains(">" + name + "</text>"));
  }
}

TEST_CASE("draw: points stand where the scene has them") {
  // Five-bar: A (0, 0), B (1, 0), P1 (-1, -1), P2 (0.5, -2), P3 (2, -1); one scale for both axes, y up.
  const auto p = points(drawing(models + "/five_bar/five_bar.toml", {"--no-names", "--width", "740"}));
  const std::vector<std::pair<double, double>> at = {{0, 0}, {1, 0}, {-1, -1}, {0.5, -2}, {2, -1}};
  REQUIRE(p.size() == at.size());
  const double scale = (740 - 140) / 3.0;
  for (std::size_t i = 1; i < p.size(); ++i) {
    CHECK(p[i].first - p[0].first == Approx(scale * at[i].first).margin(0.11));  // written with one decimal
    CHECK(p[i].second - p[0].second == Approx(-scale * at[i].second).margin(0.11));
  }
}

TEST_CASE("draw: views of a spatial scene") {
  // Bricard's hinges on the edges of a cube: in each view along an axis they fall on the corners of a square.
  const std::string scene = models + "/bricard/bricard.toml";
  for (const std::string view : {"xy", "xz", "yz"}) {
    INFO(view);
    const std::string svg = drawing(scene, {"--view", view, "--no-names"});
    require_well_formed(svg);
    CHECK(points(svg).size() == 4);
  }
  CHECK(points(drawing(scene, {"--no-names"})).size() == 6);
  CHECK(drawing(scene, {"--view", "isometric"}) == drawing(scene));
}

TEST_CASE("draw: every kind's example and every model") {
  const WorkingDirectory here;
  for (const auto& kind : costate::scene_kinds()) {
    INFO(kind.name);
    write_text(here / "s.toml", kind.example);
    require_well_formed(drawing((here / "s.toml").string()));
  }
}

TEST_CASE("draw: files and mistakes") {
  const WorkingDirectory here;
  const std::string scene = models + "/heavy_top/heavy_top.toml";
  const Outcome written = run_costate({"draw", scene, "-o", "top.svg"}, here.path());
  CHECK(written.status == 0);
  CHECK(written.out.empty());
  CHECK(file_text(here / "top.svg") == drawing(scene));
  const Outcome nowhere = run_costate({"draw", scene, "-o", "none/top.svg"}, here.path());
  CHECK(nowhere.status == 1);
  CHECK_THAT(nowhere.err, Contains("'none/top.svg' cannot be written"));
  CHECK(run_costate({"draw", scene, "--view", "zx"}, here.path()).status == 2);
  CHECK(here.entries() == std::vector<std::string>{"top.svg"});
}

TEST_CASE("draw: at a time of the run") {
  const std::string scene = models + "/five_bar/five_bar.toml";
  CHECK(drawing(scene, {"--at", "0"}) == drawing(scene));
  const std::string later = drawing(scene, {"--at", "1.5", "--no-names"});
  CHECK(later != drawing(scene, {"--no-names"}));
  // Bars keep their lengths: A and P1 are sqrt(2) apart at any time, A and B one.
  const auto p = points(later);
  REQUIRE(p.size() == 5);
  const auto apart = [&](std::size_t i, std::size_t k) {
    return std::hypot(p[i].first - p[k].first, p[i].second - p[k].second);
  };
  CHECK(apart(0, 2) / apart(0, 1) == Approx(std::sqrt(2)).epsilon(2e-3));  // one decimal of some 200 pixels
  const WorkingDirectory here;
  const Outcome late = run_costate({"draw", scene, "--at", "7"}, here.path());
  CHECK(late.status == 1);
  CHECK_THAT(late.err, Contains("--at: The run goes from 0 to 5 s, found 7 s"));
}
