// costate pareto: the front between cases against one that is known, with its concave part; journal, page, refusals.
#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "process.h"
#include "support/markup.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kTwoGoals = COSTATE_SOURCE_DIR "/test/cases/two_goals.toml";

/// The front of two_goals.toml: f2 where f1 is given.
double on_front(double f1) {
  const double b = 2 - std::sqrt(-std::log(1 - f1));
  return 1 - std::exp(-b * b);
}

}  // namespace

TEST_CASE("pareto: the front of a problem in closed form, its concave part included") {
  const WorkingDirectory here;
  const Json j = costate_json({"pareto", kTwoGoals, "--points", "9", "--output", "out"}, here.path());
  CHECK(j.at("status") == "ok");
  CHECK(j.at("objectives") == Json({"near", "far"}));
  REQUIRE(j.at("points").size() == 9);
  // The ends: 0 and 1 - exp(-4).
  CHECK(std::abs(j.at("ideal").at("near").get<double>()) < 1e-7);
  CHECK(j.at("nadir").at("far").get<double>() == Approx(1 - std::exp(-4)).epsilon(1e-6));
  int k = 0;
  for (const Json& p : j.at("points")) {
    INFO(p.dump());
    CHECK(p.at("converged") == true);
    CHECK(p.at("dominated") == false);
    const double f1 = p.at("targets").at("near"), f2 = p.at("targets").at("far");
    // Off the front by what the search leaves, 10 rtol = 1e-7 of the targets; near the ends sqrt(-ln(1 - f1)) makes
    // more of it, up to sqrt(1e-7).
    if (!p.at("end")) CHECK(f2 == Approx(on_front(f1)).margin(1e-6));
    // On the ray through (b, 1 - b) along the diagonal, in the units of the ranges: b_1 - b_2 = f_1 - f_2.
    const double range = 1 - std::exp(-4), b = 1 - static_cast<double>(8 - k) / 8;
    if (!p.at("end")) CHECK((f1 - f2) / range == Approx(2 * b - 1).margin(1e-5));
    CHECK(p.at("parameters").at("x").get<double>() == Approx(p.at("parameters").at("y").get<double>()).margin(2e-3));
    ++k;
  }
  // Every weighted sum has its least at an end: the front bulges outwards between them.
  const double middle = j.at("points").at(4).at("targets").at("near");
  CHECK(middle == Approx(1 - std::exp(-1)).epsilon(1e-5));
  CHECK(middle > (1 - std::exp(-4)) / 2);
  // The files say the same.
  std::istringstream csv(file_text(here / "out/pareto.csv"));
  std::string line;
  std::getline(csv, line);
  CHECK(line == "point,kind,dominated,converged,repeated,violation,evaluations,near,far,psi.near,psi.far,x,y");
  int rows = 0;
  while (std::getline(csv, line)) ++rows;
  CHECK(rows == 10);
  const std::string page = file_text(here / "out/pareto.html");
  CHECK(xml_fault(page).empty());
  CHECK(foreign_references(page).empty());
  CHECK(all_between(page, "<circle ", ">").size() >= 10);
  CHECK_THAT(page, Contains("least near") && Contains("data-name=\"Pareto front\""));
}

TEST_CASE("pareto: a run cut in the middle goes on to the same front") {
  const WorkingDirectory here;
  const Json j = costate_json({"pareto", kTwoGoals, "--points", "4", "--output", "out"}, here.path());
  const std::string journal = file_text(here / "out/pareto.jsonl");
  const auto lines = std::count(journal.begin(), journal.end(), '\n');
  for (const double part : {0.2, 0.7}) {
    std::size_t end = 0;
    for (int line = 0; line < static_cast<int>(part * static_cast<double>(lines)); ++line)
      end = journal.find('\n', end) + 1;
    write_text(here / "out/pareto.jsonl", journal.substr(0, end + 20));  // and a torn line
    const Json again = costate_json({"pareto", kTwoGoals, "--points", "4", "--output", "out", "--resume"}, here.path());
    CHECK(again.at("points") == j.at("points"));
  }
  const Outcome other = run_costate({"pareto", kTwoGoals, "--points", "5", "--output", "out", "--resume"}, here.path());
  CHECK(other.status == 1);
  CHECK_THAT(other.err, Contains("pareto"));
}

TEST_CASE("pareto: three objectives, and the groups that cases make") {
  const WorkingDirectory here;
  // Squares of the distances from three points: the front is their triangle.
  std::string text = file_text(kTwoGoals);
  text = text.substr(0, text.find("[[case]]"));
  text += "[output.third]\nformula = \"P.x^2 + (P.y - 1)^2\"\nunit = \"1\"\n";
  for (const char* name : {"near", "far", "third"})
    text +=
        std::string("[[case]]\nname = \"") + name + "\"\nset = { \"cost.terminal[0].output\" = \"" + name + "\" }\n";
  const auto replace = [&](const std::string& old, const std::string& now) {
    const std::size_t at = text.find(old);
    REQUIRE(at != std::string::npos);
    text.replace(at, old.size(), now);
  };
  replace("1 - exp(-(P.x - 0.7071067811865476)^2 - (P.y - 0.7071067811865476)^2)", "(P.x - 1)^2 + P.y^2");
  replace("1 - exp(-(P.x + 0.7071067811865476)^2 - (P.y + 0.7071067811865476)^2)", "(P.x + 1)^2 + P.y^2");
  write_text(here / "three.toml", text);
  const Json j = costate_json({"pareto", "three.toml", "--points", "4", "--output", "out"}, here.path());
  CHECK(j.at("points").size() == 3 + 7);  // of ten points of the simplex three are ends
  for (const Json& p : j.at("points")) {
    INFO(p.dump());
    const double x = p.at("parameters").at("x"), y = p.at("parameters").at("y");
    CHECK(y > -1e-4);
    CHECK(std::abs(x) + y < 1 + 1e-4);
  }
  CHECK(all_between(file_text(here / "out/pareto.html"), "over near</title>", "\n").size() == 4);
  // Two of one objective are one axis.
  const Json two = costate_json(
      {"pareto", "three.toml", "--points", "3", "--set", "case[1].objective=near", "--no-files"}, here.path());
  CHECK(two.at("objectives") == Json({"near", "third"}));
}

TEST_CASE("pareto: what has no front says so") {
  const WorkingDirectory here;
  const std::string pendulum = COSTATE_MODELS_DIR "/damped_pendulum/damped_pendulum.toml";
  Outcome o = run_costate({"pareto", pendulum, "--no-files"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("[[case]]"));
  o = run_costate({"pareto", kTwoGoals, "--no-files", "--set", "case[1].objective=near"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("one 'objective'"));
  o = run_costate({"pareto", kTwoGoals, "--no-files", "--algorithm", "lbfgs"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("slsqp"));
  o = run_costate({"pareto", kTwoGoals, "--no-files", "--points", "1"}, here.path());
  CHECK(o.status == 1);
  // The same objective twice: nothing to trade.
  const Json j =
      costate_json({"pareto", kTwoGoals, "--no-files", "--set", "case[1].set={ \"run.t_end_s\" = 0.2 }"}, here.path());
  CHECK(j.at("points").size() == 2);
  CHECK_THAT(j.at("notes").at(0).get<std::string>(), Contains("nothing to trade"));
}

TEST_CASE("pareto: ends of squares, whose least is zero") {
  const WorkingDirectory here;
  const auto front = [&](const std::string& near, const std::string& far) {
    return costate_json({"pareto", kTwoGoals, "--no-files", "--points", "5", "--set",
                         "output.near.formula=\"" + near + "\"", "--set", "output.far.formula=\"" + far + "\""},
                        here.path());
  };
  // A psi that falls to zero, by its square in each step, is no search that goes on.
  const Json j = front("(P.x - 1)^2 + 0*P.y", "(P.x + 1)^2 + P.y^2");
  CHECK(j.at("points").size() == 5);
  for (const Json& p : j.at("points")) {
    INFO(p.dump());
    CHECK(p.at("converged") == true);
    CHECK(p.at("evaluations").get<int>() < 60);
  }
  // Both are least at the origin, the second one there alone.
  const Json one = front("P.x^2 + 0*P.y", "3 + 2*P.x^2 + P.y^2");
  INFO(one.at("notes").dump());
  for (const Json& note : one.at("notes"))
    CHECK(note.get<std::string>().find("'far' is at its least at many designs") == std::string::npos);
}

TEST_CASE("pareto: --verbose adds the settings, counters being of single runs") {
  const WorkingDirectory here;
  const Outcome o = run_costate({"pareto", kTwoGoals, "--points", "3", "--verbose", "--no-files"}, here.path());
  INFO(o.err);
  CHECK(o.status == 0);
  CHECK(o.err.find("costate: ") == std::string::npos);
  CHECK_THAT(o.out, Contains("settings:"));
}
