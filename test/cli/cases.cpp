// One design over several cases, [[case]]: gradients and optima of their weighted sum and of the worst of them, against
// the cases run one by one and against what is known in closed form; what cannot be carried is refused.
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
const std::string kTwoGoals = COSTATE_SOURCE_DIR "/test/cases/two_goals.toml";

/// A damper that two swings of different starts are judged by: the scene itself and one with a stiffer spring.
std::string two_swings(const std::string& more = "") {
  return "include = [\"" + kPendulum +
         "\"]\n[[case]]\nname = \"soft\"\nweight = 2.0\nscale = 0.5\n[[case]]\nname = \"stiff\"\nscene = "
         "\"stiff.toml\"\n"
         "set = { \"run.t_end_s\" = 4.0 }\nweight = 3.0\n" +
         more;
}

void write_swings(const WorkingDirectory& here, const std::string& more = "") {
  write_text(here / "swings.toml", two_swings(more));
  write_text(here / "stiff.toml", "include = [\"" + kPendulum + "\"]\n[spring.strut]\nstiffness_N_per_m = 35.0\n");
}

std::string refused(const std::vector<std::string>& arguments, const WorkingDirectory& here) {
  const Outcome o = run_costate(arguments, here.path());
  CHECK(o.status == 1);
  return o.err;
}

}  // namespace

TEST_CASE("cases: a gradient without parameters says so") {
  const WorkingDirectory here;
  write_swings(here, "[run]\nparameters = []\n");
  const Outcome o = run_costate({"gradient", "swings.toml", "--no-files"}, here.path());
  INFO(o.err);
  CHECK(o.status == 0);
  CHECK_THAT(o.err, Contains("no parameter to differentiate by"));
}

TEST_CASE("cases: psi and gradient are the weighted sums of the cases' own") {
  const WorkingDirectory here;
  write_swings(here);
  const Json j = costate_json({"gradient", "swings.toml"}, here.path());
  const Json soft = costate_json({"gradient", kPendulum, "--no-files"}, here.path());
  const Json stiff = costate_json({"gradient", "stiff.toml", "--t-end", "4", "--no-files"}, here.path());
  const auto g = [](const Json& of) { return of.at("gradient").at("c").get<double>(); };
  const auto psi = [](const Json& of) { return of.at("psi").get<double>(); };
  // The same runs, so that only the sum rounds.
  CHECK(j.at("cases").at(0).at("psi") == soft.at("psi"));
  CHECK(j.at("cases").at(1).at("psi") == stiff.at("psi"));
  CHECK(psi(j) == Approx(4 * psi(soft) + 3 * psi(stiff)).epsilon(1e-15));
  CHECK(g(j) == Approx(4 * g(soft) + 3 * g(stiff)).epsilon(1e-15));
  CHECK(j.at("goal") == "sum");
  // One by one they are the same numbers, to the bit, and so is a case by its name.
  const Json one = costate_json({"gradient", "swings.toml", "--jobs", "1"}, here.path());
  CHECK(one.at("psi") == j.at("psi"));
  CHECK(one.at("gradient") == j.at("gradient"));
  const Json named = costate_json({"gradient", "swings.toml", "--case", "stiff"}, here.path());
  CHECK(named.at("psi") == stiff.at("psi"));
  CHECK(named.at("gradient") == stiff.at("gradient"));
  // The worst is the larger of the two.
  const Json worst = costate_json({"gradient", "swings.toml", "--goal", "worst"}, here.path());
  CHECK(psi(worst) == std::max(4 * psi(soft), 3 * psi(stiff)));
  CHECK(worst.at("worst") == (4 * psi(soft) > 3 * psi(stiff) ? "soft" : "stiff"));
  const Json estimated = costate_json({"gradient", "swings.toml", "--estimate-error"}, here.path());
  CHECK(estimated.at("psi_error").get<double>() > 0);
  CHECK(estimated.at("gradient_error").at("c").get<double>() > 0);
}

TEST_CASE("cases: the design's value of a parameter is that of every case") {
  const WorkingDirectory here;
  write_swings(here);
  const std::string path = "spring.strut.damping_N_s_per_m";
  const Json j = costate_json({"gradient", "swings.toml", "--set", path + "=3"}, here.path());
  const Json stiff =
      costate_json({"gradient", "stiff.toml", "--t-end", "4", "--set", path + "=3", "--no-files"}, here.path());
  // Its scale is the scene's there and the new value here, by which runs are resolved further or not.
  CHECK(j.at("cases").at(1).at("psi").get<double>() == Approx(stiff.at("psi").get<double>()).epsilon(2e-6));
  const Json run = costate_json({"simulate", "swings.toml", "--case", "stiff", "--set", path + "=3"}, here.path());
  CHECK(run.at("psi").get<double>() == Approx(stiff.at("psi").get<double>()).epsilon(1e-6));
}

TEST_CASE("cases: the optimum of the sum, its certificate, page and files, a resumed run is the same") {
  const WorkingDirectory here;
  write_swings(here);
  const Json j = costate_json({"optimize", "swings.toml", "--output", "out"}, here.path());
  CHECK_THAT(j.at("certificate").at("verdict").get<std::string>(), Contains("strict local minimum"));
  // Of a smooth function of one number: the derivative vanishes to what two runs at rtol 1e-8 know, and either side is
  // higher. psi'' is the certificate's eigenvalue.
  const double c = j.at("parameters").at("c");
  const auto at = [&](double value) {
    return costate_json(
        {"gradient", "swings.toml", "--no-files", "--set", "spring.strut.damping_N_s_per_m=" + std::to_string(value)},
        here.path());
  };
  const Json below = at(c - 0.1), above = at(c + 0.1);
  CHECK(below.at("psi").get<double>() > j.at("psi").get<double>());
  CHECK(above.at("psi").get<double>() > j.at("psi").get<double>());
  const double second = (above.at("gradient").at("c").get<double>() - below.at("gradient").at("c").get<double>()) / 0.2;
  CHECK(j.at("certificate").at("smallest_eigenvalue").get<double>() == Approx(second).epsilon(1e-2));
  const std::string page = file_text(here / "out/report.html");
  CHECK(xml_fault(page).empty());
  CHECK_THAT(page, Contains("Motion of the case stiff") && Contains("psi of soft"));
  for (const char* file : {"before_soft.h5", "after_stiff.csv", "optimized.toml"})
    CHECK(std::filesystem::exists(here / "out" / std::string(file)));
  // The scene found is one of the same cases, from where it is.
  const Json again = costate_json({"gradient", "out/optimized.toml", "--no-files"}, here.path());
  // By other steps, some hundred, each right to the tolerance.
  CHECK(again.at("psi").get<double>() ==
        Approx(j.at("psi").get<double>()).epsilon(100 * again.at("rtol").get<double>()));
  // Cut behind the third evaluation the run goes on to the same end.
  const std::string journal = file_text(here / "out/evaluations.jsonl");
  std::size_t end = 0;
  for (int line = 0; line < 4; ++line) end = journal.find('\n', end) + 1;
  write_text(here / "out/evaluations.jsonl", journal.substr(0, end));
  const Json resumed = costate_json({"optimize", "swings.toml", "--output", "out", "--resume"}, here.path());
  CHECK(resumed.at("psi") == j.at("psi"));
  CHECK(resumed.at("parameters") == j.at("parameters"));
  const auto lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  CHECK(lines(file_text(here / "out/evaluations.jsonl")) == lines(journal));
  // Another content of a case's file is another run.
  write_text(here / "stiff.toml", file_text(here / "stiff.toml") + "damping_N_s_per_m = 1.0\nnatural_length_m = 0.9\n");
  CHECK_THAT(refused({"optimize", "swings.toml", "--output", "out", "--resume"}, here), Contains("journal"));
}

TEST_CASE("cases: the worst of two has its least where both are equal, with the multipliers of the kink") {
  const WorkingDirectory here;
  for (const char* algorithm : {"slsqp", "mma"}) {
    const Json j = costate_json({"optimize", kTwoGoals, "--goal", "worst", "--algorithm", algorithm, "--output", "out"},
                                here.path());
    INFO(algorithm);
    // By symmetry x = y = 0: f = 1 - exp(-1) in both, whose gradients are opposite. The kink is sharp: errors of psi
    // are those of x to first order, and both are far below what NLopt's tolerance of 1e-10 of psi leaves.
    CHECK(j.at("psi").get<double>() == Approx(1 - std::exp(-1)).epsilon(1e-8));
    CHECK(std::abs(j.at("parameters").at("x").get<double>()) < 1e-4);
    CHECK(std::abs(j.at("parameters").at("y").get<double>()) < 1e-4);
    const Json& c = j.at("certificate");
    CHECK_THAT(c.at("verdict").get<std::string>(), Contains("strict local minimum"));
    CHECK(c.at("multipliers").at("worst.near").get<double>() == Approx(0.5).epsilon(1e-3));
    CHECK(c.at("multipliers").at("worst.far").get<double>() == Approx(0.5).epsilon(1e-3));
  }
  // Where nobody chose one it is an algorithm that takes them.
  CHECK(costate_json({"optimize", kTwoGoals, "--goal", "worst", "--no-files"}, here.path()).at("algorithm") == "slsqp");
  CHECK_THAT(refused({"optimize", kTwoGoals, "--goal", "worst", "--algorithm", "lbfgs", "--no-files"}, here),
             Contains("worst of several cases") && Contains("slsqp"));
}

TEST_CASE("cases: one may be a bound of the others") {
  const WorkingDirectory here;
  // far at most 0.5: on x = y the distance from its centre is sqrt(ln 2).
  std::string text = file_text(kTwoGoals);
  write_text(here / "s.toml", text + "upper = 0.5\n");
  const Json j = costate_json({"optimize", "s.toml", "--output", "out"}, here.path());
  const double s = std::sqrt(std::log(2)) / std::sqrt(2) - 1 / std::sqrt(2);
  CHECK(j.at("parameters").at("x").get<double>() == Approx(s).margin(1e-5));
  CHECK(j.at("parameters").at("y").get<double>() == Approx(s).margin(1e-5));
  CHECK(j.at("constraints").at(0).at("name") == "far");
  CHECK(j.at("constraints").at(0).at("psi").get<double>() == Approx(0.5).epsilon(1e-6));
  // mu = -(df1/ds)/(df2/ds) along x = y = s.
  const double a = 2 - std::sqrt(std::log(2)), b = std::sqrt(std::log(2));
  const double mu = a * std::exp(-a * a) / (b * std::exp(-b * b));
  CHECK(j.at("certificate").at("multipliers").at("constraint.far").get<double>() == Approx(mu).epsilon(1e-3));
}

TEST_CASE("cases: what cannot be is refused with its place and what to do") {
  const WorkingDirectory here;
  write_swings(here);
  CHECK_THAT(refused({"simulate", "swings.toml", "--no-files"}, here),
             Contains("--case NAME") && Contains("soft, stiff") && Contains("swings.toml:2"));
  CHECK_THAT(refused({"check", "swings.toml", "--no-files"}, here), Contains("--case NAME"));
  CHECK_THAT(refused({"simulate", "swings.toml", "--case", "stif", "--no-files"}, here),
             Contains("Did you mean 'stiff'?"));
  CHECK_THAT(refused({"simulate", kPendulum, "--case", "stiff", "--no-files"}, here), Contains("lists no cases"));
  CHECK_THAT(refused({"gradient", kPendulum, "--goal", "worst", "--no-files"}, here), Contains("lists none"));
  CHECK_THAT(refused({"gradient", "swings.toml", "--accuracy", "1e-4", "--no-files"}, here), Contains("--accuracy"));
  CHECK_THAT(refused({"optimize", "swings.toml", "--adapt-accuracy", "--no-files"}, here), Contains("several cases"));
  const auto with = [&](const std::string& old, const std::string& now) {
    std::string text = two_swings();
    const std::size_t at = text.find(old);
    REQUIRE(at != std::string::npos);
    write_text(here / "s.toml", text.replace(at, old.size(), now));
    return refused({"gradient", "s.toml", "--no-files"}, here);
  };
  CHECK_THAT(with("name = \"stiff\"", "name = \"soft\""), Contains("another case"));
  CHECK_THAT(with("weight = 3.0", "weight = -3.0"), Contains("weight") && Contains("positive"));
  CHECK_THAT(with("weight = 3.0", "wieght = 3.0"), Contains("Did you mean 'weight'?"));
  CHECK_THAT(with("stiff.toml", "stif.toml"), Contains("stif.toml") && Contains("s.toml:6"));
  CHECK_THAT(with("weight = 3.0", "upper = 3.0\nscale = 2.0"), Contains("upper"));
  CHECK_THAT(with("\"run.t_end_s\" = 4.0", "\"run.t_end_s\" = -4.0"), Contains("t_end_s"));
  CHECK_THAT(with("weight = 3.0", "without = [\"d\"]"), Contains("no parameter of the design"));
  CHECK_THAT(with("weight = 3.0", "without = [\"c\"]"), Contains("depends on no parameter"));
  write_text(here / "other.toml", two_swings());
  CHECK_THAT(with("stiff.toml", "other.toml"), Contains("lists cases itself"));
  write_text(here / "other.toml",
             "include = [\"" + kPendulum + "\"]\nremove = [\"parameter.c\", \"run.parameters\"]\n");
  CHECK_THAT(with("stiff.toml", "other.toml"), Contains("has no parameter 'c'") && Contains("without"));
  // Where every case has a scene of its own, --set of this one would change nothing.
  std::string own = two_swings();
  own.insert(own.find("weight = 2.0"), "scene = \"stiff.toml\"\n");
  write_text(here / "own.toml", own);
  CHECK_THAT(refused({"gradient", "own.toml", "--no-files", "--set", "bar.rod.mass_kg=3"}, here),
             Contains("would change nothing"));
  CHECK(run_costate({"gradient", "own.toml", "--no-files", "--set", "spring.strut.damping_N_s_per_m=3"}, here.path())
            .status == 0);
}

TEST_CASE("cases: an evaluation that fails in one case is a rejected step of all") {
  const WorkingDirectory here;
  // The second case cannot be evaluated for x below 0.35, where a root has no value; the first alone would go there.
  std::string text = file_text(kTwoGoals);
  text +=
      "scale = 1.0\n[output.root]\nformula = \"0.001*sqrt(P.x - 0.35)\"\nunit = \"1\"\n"
      "[point.P]\n";
  text = file_text(kTwoGoals);
  const std::string old = "0.7071067811865476)^2)\"\nunit = \"1\"\n\n[start]";
  const std::size_t at = text.find(old);
  REQUIRE(at != std::string::npos);
  text.replace(at, old.size(), "0.7071067811865476)^2) + 0.001*sqrt(P.x + 0.35)\"\nunit = \"1\"\n\n[start]");
  write_text(here / "s.toml", text);
  const Json j = costate_json({"optimize", "s.toml", "--set", "case[0].weight=0.01", "--output", "out"}, here.path());
  CHECK(j.at("failed_evaluations").get<int>() > 0);
  for (const Json& e : j.at("evaluations"))
    if (e.contains("failure")) CHECK_THAT(e.at("failure").get<std::string>(), Contains("case.far"));
  CHECK(j.at("parameters").at("x").get<double>() >= -0.35);
}
