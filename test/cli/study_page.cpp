// The page of a study: its table, and of designs dots, parallel coordinates and the front, against the tables beside
// it.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "process.h"
#include "support/markup.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kPendulum = COSTATE_MODELS_DIR "/damped_pendulum/damped_pendulum.toml";
const std::string kDamping = "spring.strut.damping_N_s_per_m", kStiffness = "spring.strut.stiffness_N_per_m";

std::string design_text(const std::string& more) {
  return "title = \"a < b\"\n[[run]]\nname = \"one\"\nscene = \"" + kPendulum +
         "\"\noptions = { max_evaluations = 3 }\n[[design]]\nname = \"d\"\nscene = \"" + kPendulum +
         "\"\ntask = \"simulate\"\nkind = \"latin-hypercube\"\ncount = 12\noutputs = [\"P.x\", \"P.y\"]\n" + more +
         "[design.vary]\n\"" + kDamping + "\" = { from = 1, to = 9 }\n\"" + kStiffness +
         "\" = { from = 10, to = 40 }\n";
}

}  // namespace

TEST_CASE("study page: dots, parallel coordinates and the front say what the tables say") {
  const WorkingDirectory here;
  write_text(here / "s.toml", design_text("pareto = [\"psi\", \"P.x\"]\n"));
  const Json j = costate_json({"study", "s.toml", "--output", "out"}, here.path());
  const std::string page = file_text(here / "out/report.html");
  CHECK(xml_fault(page).empty());
  CHECK(foreign_references(page).empty());
  CHECK(page.rfind("<!DOCTYPE html>", 0) == 0);
  CHECK_THAT(page, Contains("a &lt; b") && Contains("Design d"));
  // The front, by going through all pairs.
  std::vector<Json> rows;
  for (const Json& r : j.at("runs"))
    if (r.contains("design")) rows.push_back(r);
  REQUIRE(rows.size() == 12);
  Json expected = Json::array();
  for (const Json& a : rows) {
    const auto beats = [&](const Json& b) {
      const double p = a.at("psi"), q = b.at("psi"), x = a.at("outputs").at("P.x"), y = b.at("outputs").at("P.x");
      return q <= p && y <= x && (q < p || y < x);
    };
    if (std::none_of(rows.begin(), rows.end(), beats)) expected.push_back(a.at("name"));
  }
  CHECK(j.at("pareto").at("d").at("front") == expected);
  CHECK(j.at("pareto").at("d").at("quantities") == Json({"psi", "P.x"}));
  // The front's plot, and one of each result (psi and two outputs) over each number varied.
  std::vector<std::string> plots = all_between(page, "<svg ", "</svg>");
  std::erase_if(plots, [](const std::string& svg) { return svg.find("data-across=") == std::string::npos; });
  REQUIRE(plots.size() == 1 + 3 * 2);
  // Every point, those of the front once more, and the front's dot in the legend.
  CHECK(all_between(plots[0], "<circle ", ">").size() == 12 + expected.size() + 1);
  for (std::size_t k = 1; k < plots.size(); ++k) CHECK(all_between(plots[k], "<circle ", ">").size() == 12);
  // A dot is where the axes say: psi over the damping, by the pixels of the two ends of each axis.
  const auto numbers = [&](const std::string& attribute) {
    const std::string text = all_between(plots[1], attribute + "=\"", "\"").at(0);
    std::vector<double> x(4);
    REQUIRE(std::sscanf(text.c_str(), "%lf %lf %lf %lf", &x[0], &x[1], &x[2], &x[3]) == 4);
    return x;
  };
  const auto across = numbers("data-across"), up = numbers("data-up");
  const auto xs = all_between(plots[1], "<circle cx=\"", "\""), ys = all_between(plots[1], "cy=\"", "\"");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto value = [](const std::vector<double>& axis, double pixel) {
      return axis[2] + (pixel - axis[0]) / (axis[1] - axis[0]) * (axis[3] - axis[2]);
    };
    // Thousandths of a pixel are printed, of some 300 across and 170 up.
    CHECK(value(across, std::stod(xs[i])) == Approx(rows[i].at("varied").at(kDamping).get<double>()).margin(8 * 2e-4));
    CHECK(value(up, std::stod(ys[i])) ==
          Approx(rows[i].at("psi").get<double>()).margin(4e-4 * std::abs(up[3] - up[2])));
  }
  const auto parallel = all_between(page, "class=\"parallel\"", "</svg>");
  REQUIRE(parallel.size() == 1);
  CHECK(all_between(parallel[0], "<path ", "/path>").size() == 12);
  CHECK(all_between(parallel[0], "<line ", "/>").size() == 5);  // two numbers, psi, two outputs
}

TEST_CASE("study page: what cannot be on a front is refused") {
  const WorkingDirectory here;
  write_text(here / "s.toml", design_text("pareto = [\"psi\", \"P.z\"]\n"));
  Outcome o = run_costate({"study", "s.toml", "--output", "out"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("P.z") && Contains("'pareto'"));
  write_text(here / "s.toml", design_text("pareto = [\"psi\"]\n"));
  o = run_costate({"study", "s.toml", "--output", "out"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("two quantities"));
}

TEST_CASE("study page: the cases of a scene are quantities of its runs") {
  const WorkingDirectory here;
  const std::string goals = COSTATE_SOURCE_DIR "/test/cases/two_goals.toml";
  write_text(here / "s.toml",
             "[[design]]\nname = \"d\"\nscene = \"" + goals +
                 "\"\ntask = \"gradient\"\nkind = \"grid\"\npareto = [\"near\", \"far\"]\n[design.vary]\n"
                 "\"point.P.x_m\" = { from = -1, to = 1, steps = 5 }\n\"point.P.y_m\" = { from = -1, to "
                 "= 1, steps = 5 }\n");
  const Json j = costate_json({"study", "s.toml", "--output", "out"}, here.path());
  // Of the grid those on x = y between the two centres, at 0.707, are on the front: x = y in {-0.5, 0, 0.5}, and what
  // is no farther from one centre than these.
  const auto front = j.at("pareto").at("d").at("front").get<std::vector<std::string>>();
  for (const Json& r : j.at("runs")) {
    const double x = r.at("varied").at("point.P.x_m"), y = r.at("varied").at("point.P.y_m");
    const double c = std::sqrt(0.5);
    const auto f = [&](double s) { return 1 - std::exp(-(x - s) * (x - s) - (y - s) * (y - s)); };
    CHECK(r.at("cases").at("near").get<double>() == Approx(f(c)).margin(1e-12));
    CHECK(r.at("cases").at("far").get<double>() == Approx(f(-c)).margin(1e-12));
    if (x == y && std::abs(x) < 0.7) CHECK(std::find(front.begin(), front.end(), r.at("name")) != front.end());
  }
  CHECK_THAT(file_text(here / "out/d.csv"), Contains("psi.near,psi.far"));
}
