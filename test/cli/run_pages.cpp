// The pages of costate gradient --report and costate cycle --report: whole, self-contained, with the summary's numbers.
#include <catch2/catch.hpp>
#include <cmath>

#include "five_bar.h"
#include "process.h"
#include "support/markup.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

TEST_CASE("gradient page: derivatives in the proportions of the summary, and the motion") {
  const WorkingDirectory here;
  const Json j = costate_json({"gradient", kFiveBar, "--report", "--estimate-error", "--output", "out"}, here.path());
  const std::string page = file_text(here / "out/gradient.html");
  CHECK(xml_fault(page).empty());
  CHECK(foreign_references(page).empty());
  CHECK_THAT(page, Contains("estimated error") && Contains("<h2>Motion</h2>"));
  const auto drawing = all_between(page, "class=\"bars\"", "</svg>");
  REQUIRE(drawing.size() == 1);
  const auto widths = all_between(drawing[0], " width=\"", "\" height=\"14\"");
  REQUIRE(widths.size() == 2);
  // The scale of a length is its start value, which the file has; a hundredth of a pixel of 200 is printed.
  const double a = std::abs(j.at("gradient").at("L01").get<double>() * 2.23606797749979),
               b = std::abs(j.at("gradient").at("L02").get<double>() * 2.0615528128088303);
  CHECK(std::stod(widths[0]) == Approx(200 * a / std::max(a, b)).margin(0.006));
  CHECK(std::stod(widths[1]) == Approx(200 * b / std::max(a, b)).margin(0.006));
  CHECK(run_costate({"gradient", kFiveBar, "--report", "--no-files"}, here.path()).status == 1);
}

TEST_CASE("gradient page: of several cases each one's derivatives") {
  const WorkingDirectory here;
  costate_json({"gradient", COSTATE_SOURCE_DIR "/test/cases/two_goals.toml", "--report", "--output", "out"},
               here.path());
  const std::string page = file_text(here / "out/gradient.html");
  CHECK(xml_fault(page).empty());
  CHECK_THAT(page, Contains("psi of near") && Contains("psi of far"));
}

TEST_CASE("cycle page: multipliers where the summary has them") {
  const WorkingDirectory here;
  const Json j = costate_json(
      {"cycle", COSTATE_MODELS_DIR "/cycles/forced_oscillator.toml", "--report", "--output", "out"}, here.path());
  const std::string page = file_text(here / "out/cycle.html");
  CHECK(xml_fault(page).empty());
  CHECK(foreign_references(page).empty());
  const auto drawing = all_between(page, "class=\"multipliers\"", "</svg>");
  REQUIRE(drawing.size() == 1);
  const double unit = std::stod(all_between(drawing[0], " r=\"", "\"").at(0));
  const auto x = all_between(drawing[0], "class=\"m\" cx=\"", "\"");
  REQUIRE(x.size() == j.at("multipliers").size());
  for (std::size_t i = 0; i < x.size(); ++i)  // a hundredth of a pixel is printed
    CHECK((std::stod(x[i]) - 160) / unit == Approx(j.at("multipliers").at(i).at(0).get<double>()).margin(1e-3));
  CHECK_THAT(page, Contains("<h2>Motion</h2>"));
}
