// Verdicts that were false: certificates of points whose psi curves along one parameter ten thousand times more than
// along another, of constraints that no point meets, and the ends of fronts where one target is at its least at many
// designs. All costs are polynomials of where a mass flies to in 1 s, so that optima are known in closed form.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <tuple>

#include "process.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

/// P.x = a and P.y = b at the end, from the given starts; |a| <= 2, b as said.
std::string scene(const std::string& formula, const std::string& bounds_of_b, double a = 0.9, double b = 0.5) {
  return fmt::format(R"([point.P]
x_m = 0
y_m = 0
vx_m_per_s = {}
vy_m_per_s = {}
[mass.m]
point = "P"
mass_kg = 1
[start]
given = ["P.x", "P.y"]
[parameter.a]
number = "point.P.vx_m_per_s"
lower = -2
upper = 2
[parameter.b]
number = "point.P.vy_m_per_s"
{}
[run]
t_end_s = 1
parameters = ["a", "b"]
[output.f]
formula = "{}"
unit = "1"
[[cost.terminal]]
kind = "value"
output = "f"
)",
                     a, b, bounds_of_b, formula);
}

const std::string kUnitBounds = "lower = -1\nupper = 1\n";

Json optimized(const WorkingDirectory& here, const std::string& text) {
  write_text(here / "s.toml", text);
  return costate_json({"optimize", "s.toml", "--no-files"}, here.path());
}

}  // namespace

TEST_CASE("verdicts: a bound holds a parameter whatever psi curves by along another") {
  const WorkingDirectory here;
  for (const char* formula :
       {"1e4*(P.x-1)^2-0.5*P.y", "1e4*(P.x-1)^2+2*(P.y-1.2)^2", "1e4*(P.x-1)^2-0.5*P.y-(P.y-1)^2"}) {
    INFO(formula);
    const Json j = optimized(here, scene(formula, "lower = 0.8\nupper = 1\n", 0.9, 0.9));
    CHECK(j.at("parameters").at("b") == 1.0);
    const Json& c = j.at("certificate");
    CHECK_THAT(c.at("verdict").get<std::string>(), Contains("strict local minimum"));
    CHECK(c.at("active") == Json({"b.upper"}));
    // d(psi)/db at b = 1: -0.5, -0.8, -0.5.
    const double right = std::string(formula).find("1.2") != std::string::npos ? 0.8 : 0.5;
    CHECK(c.at("multipliers").at("b.upper").get<double>() == Approx(right).epsilon(1e-5));
  }
}

TEST_CASE("verdicts: a slope along which psi does not curve is one, whatever the scale") {
  // Stopped where b, whose scale is its start's 1e-4, may still go 1e4 of these.
  const WorkingDirectory here;
  write_text(here / "s.toml", scene("15*(P.x-1)^2-3.5*P.y", kUnitBounds, 1, 1e-4));
  const Json j = costate_json({"optimize", "s.toml", "--no-files", "--max-evaluations", "1"}, here.path());
  CHECK_THAT(j.at("certificate").at("verdict").get<std::string>(), Contains("not stationary: psi falls by"));
}

TEST_CASE("verdicts: a constraint that no point meets is violated, not active") {
  const WorkingDirectory here;
  const std::string text = scene("(P.x-1)^2+(P.y-1)^2", kUnitBounds) +
                           "[[optimize.constraint]]\nname = \"far\"\nupper = -9\n"
                           "terminal = [{ kind = \"value\", output = \"P.x\" }]\n";
  write_text(here / "s.toml", text);
  const Outcome o = run_costate({"optimize", "s.toml", "--no-files", "--json", "--algorithm", "slsqp"}, here.path());
  const Json c = one_object(o.out).at("certificate");
  CHECK_THAT(c.at("verdict").get<std::string>(), Contains("not feasible") && Contains("'constraint.far' by 7"));
  CHECK(c.at("active").dump().find("constraint") == std::string::npos);
  // a >= -2 at least.
  CHECK(c.at("violated").at("constraint.far").get<double>() == Approx(7).epsilon(1e-3));
}

namespace {

/// f1 = a^2 whatever b is; f2 = (a - 1)^2 + (b - 1)^2.
void write_targets(const WorkingDirectory& here, const std::string& more, double b = 0.2) {
  write_text(here / "one.toml", scene("P.x^2", kUnitBounds, 0.3, b));
  write_text(here / "two.toml", scene("(P.x-1)^2+(P.y-1)^2", kUnitBounds, 0.3, b));
  write_text(here / "far.toml", scene("P.x^2+P.y^2", kUnitBounds, 0.3, b));
  write_text(here / "front.toml", scene("P.x", kUnitBounds, 0.3, b) +
                                      "[[case]]\nname = \"f1\"\nscene = \"one.toml\"\n[[case]]\nname = \"f2\"\n"
                                      "scene = \"two.toml\"\n" +
                                      more);
}

}  // namespace

TEST_CASE("verdicts: the end of a front is the best for the others where its target is at its least at many designs") {
  const WorkingDirectory here;
  write_targets(here, "");
  const Json j = costate_json({"pareto", "front.toml", "--no-files", "--points", "3"}, here.path());
  // The front is b = 1, f2 = (1 - sqrt(f1))^2; the ends (0, 1) and (1, 0), to what a thousandth of the other moves
  // them.
  CHECK(j.at("nadir").at("f2").get<double>() == Approx(1).epsilon(5e-3));
  for (const Json& p : j.at("points")) {
    INFO(p.dump());
    const double f1 = p.at("targets").at("f1"), f2 = p.at("targets").at("f2");
    CHECK(f2 == Approx(std::pow(1 - std::sqrt(std::max(0.0, f1)), 2)).margin(1e-4));
    CHECK(p.at("repeated") == false);
    CHECK(p.at("violation") == 0.0);
  }
  CHECK(j.at("notes").size() == 1);
}

TEST_CASE("verdicts: the end of a front where the others gain little by another design") {
  // From b = 0.94 on f2 gains 0.0036 of 1 along f1 = 0: less than what a thousandth of it makes of f1 times twenty.
  const WorkingDirectory here;
  write_targets(here, "", 0.94);
  const Json j = costate_json({"pareto", "front.toml", "--no-files", "--points", "3"}, here.path());
  CHECK(j.at("nadir").at("f2").get<double>() == Approx(1).epsilon(1e-4));
  CHECK(j.at("notes").size() == 1);
}

TEST_CASE("verdicts: points of a front that exceed a constraint say so") {
  const WorkingDirectory here;
  write_targets(here, "[[case]]\nname = \"g\"\nscene = \"far.toml\"\nupper = -9\n");
  const Json j = costate_json({"pareto", "front.toml", "--no-files"}, here.path());
  CHECK_THAT(j.at("warnings").dump(), Contains("exceed a constraint"));
  for (const Json& p : j.at("points")) CHECK(p.at("violation").get<double>() >= 9);
}

namespace {
/// Of a and b, a cost and two constraints by formulas.
std::string two_constraints(const std::string& cost, const std::string& first, const std::string& second, double upper,
                            const std::string& at) {
  std::string text =
      "[point.P]\nx_m = 0.3\ny_m = 0.4\n[mass.m]\npoint = \"P\"\nmass_kg = 1\n[start]\ngiven = [\"P.x\", \"P.y\"]\n";
  for (const auto& [name, formula] : {std::pair{"f0", cost}, {"f1", first}, {"f2", second}})
    text += fmt::format("[output.{}]\nformula = \"{}\"\nunit = \"1\"\n{}\n", name, formula, at);
  text += "[[cost.terminal]]\nkind = \"value\"\noutput = \"f0\"\n";
  for (const auto& [name, output, bound] : {std::tuple{"c1", "f1", 1.0}, {"c2", "f2", upper}})
    text += fmt::format(
        "[[optimize.constraint]]\nname = \"{}\"\nupper = {}\n[[optimize.constraint.terminal]]\nkind = "
        "\"value\"\noutput = \"{}\"\n",
        name, bound, output);
  for (const char* p : {"a", "b"})
    text += fmt::format(
        "[parameter.{0}]\nnumbers = [\"output.f0.{0}\", \"output.f1.{0}\", \"output.f2.{0}\"]\nlower = "
        "-2\nupper = 5\nscale = 1\n",
        p);
  return text + "[run]\nt_end_s = 0.1\nparameters = [\"a\", \"b\"]\n";
}
}  // namespace

// c2 was "active", with a part of c1's multiplier, and left no direction free: a saddle was a strict minimum.
TEST_CASE("verdicts: a constraint that is near its bound beside one that holds is not active") {
  const WorkingDirectory here;
  write_text(here / "s.toml",
             two_constraints("0-a+1e-5*b-2*b^2", "a^2+b^2", "a^2+(b-1e-3)^2", 1.000021, "a = 1\nb = 0"));
  const Json saddle = costate_json({"optimize", "s.toml", "--no-files", "--max-evaluations", "1"}, here.path());
  CHECK_THAT(saddle.at("certificate").at("verdict").get<std::string>(), !Contains("strict local minimum"));
  // On the circle, lambda = 1/2, psi curves by 2 lambda - 4.
  CHECK(saddle.at("certificate").at("hessian_eigenvalues").at(0).get<double>() == Approx(-3).epsilon(1e-3));
  for (const char* aside : {"0.003", "0.0003", "0.0001"}) {
    CAPTURE(aside);
    write_text(here / "s.toml", two_constraints("(a-3)^2+(b-0.2)^2", "a^2+b^2", std::string("a^2+(b-") + aside + ")^2",
                                                1, "a = 0\nb = 0"));
    const Json c = costate_json({"optimize", "s.toml", "--no-files"}, here.path()).at("certificate");
    CHECK(c.at("active") == Json({"constraint.c1"}));
    CHECK(c.at("multipliers").at("constraint.c1").get<double>() == Approx(std::hypot(3, 0.2) - 1).epsilon(1e-5));
    CHECK_THAT(c.at("verdict").get<std::string>(), Contains("strict local minimum"));
  }
}

// Kuhn and Tucker's cusp: both multipliers 8e4, and the tolerance of the residual 0.9 of psi's own slope.
TEST_CASE("verdicts: where constraints hold each other there is none") {
  const WorkingDirectory here;
  write_text(here / "s.toml", two_constraints("0*b-a", "b-(1-a)^3+1", "0*a-b", 0, "a = -0.5\nb = 0.5"));
  const Json c = costate_json({"optimize", "s.toml", "--no-files"}, here.path()).at("certificate");
  CHECK_THAT(c.at("verdict").get<std::string>(), Contains("hold each other"));
}

TEST_CASE("verdicts: a parameter that goes on for ever is told") {
  const WorkingDirectory here;
  const Json j = optimized(here, scene("0-P.y", ""));
  CHECK_THAT(j.at("notes").dump(), Contains("'b' went") && Contains("psi may fall for ever"));
  const Json bounded = optimized(here, scene("0-P.y", "upper = 4\n"));
  CHECK_THAT(bounded.at("notes").dump(), !Contains("for ever"));
}
