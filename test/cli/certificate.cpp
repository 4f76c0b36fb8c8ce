// costate optimize: the certificate at its end. First-order conditions with multipliers, the Hessian's
// eigenvalues, and a sentence that says what was found.
#include <catch2/catch.hpp>
#include <cmath>

#include "five_bar.h"
#include "process.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::kFiveBar;
using costate::test::Outcome;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

const Json& certificate_of(const Json& j) { return j.at("certificate"); }

std::string verdict_of(const Json& j) { return certificate_of(j).at("verdict").get<std::string>(); }

/// Of a 2 x 2 symmetric matrix, ascending.
std::pair<double, double> eigenvalues(double a, double b, double c) {
  const double mean = (a + c) / 2, radius = std::hypot((a - c) / 2, b);
  return {mean - radius, mean + radius};
}

}  // namespace

TEST_CASE("certificate: the five-bar at rest is a strict minimum") {
  const WorkingDirectory here;
  const Json j = costate_json(
      {"optimize", kFiveBar, "--output", "out", "--set", "parameter.L01.scale=1", "--set", "parameter.L02.scale=1"},
      here.path());
  const Json& c = certificate_of(j);
  CHECK_THAT(verdict_of(j), Contains("strict local minimum"));
  CHECK(c.at("hessian_formulation") == "index1");
  CHECK(c.at("hessian_note").is_null());
  CHECK(c.at("active").empty());
  CHECK(c.at("multipliers").empty());
  CHECK(c.at("free") == Json({"L01", "L02"}));
  CHECK(c.at("kkt_residual").get<double>() == Approx(c.at("projected_gradient").get<double>()));
  CHECK(c.at("kkt_residual").get<double>() <= c.at("kkt_tolerance").get<double>());
  const auto e = c.at("hessian_eigenvalues").get<std::vector<double>>();
  REQUIRE(e.size() == 2);
  CHECK(e[0] > 0);
  CHECK(c.at("smallest_eigenvalue") == e[0]);
  CHECK(c.at("largest_eigenvalue") == e[1]);
  CHECK(c.at("condition").get<double>() == Approx(e[1] / e[0]));
  CHECK(c.at("newton_step").get<double>() < 1e-6);
  CHECK(c.at("predicted_decrease").get<double>() < 1e-12);
  CHECK(c.at("predicted_decrease").get<double>() >= 0);
  CHECK(c.at("hessian_asymmetry").get<double>() < 1e-5);
  // Differences of gradients say the same: central ones over 1e-3 m, whose error is of the size of 1e-6 times
  // fourth derivatives of psi.
  const auto gradient_at = [&](double dL01, double dL02) {
    const auto value = [&](const char* name, double d) {
      return std::to_string(j.at("parameters").at(name).get<double>() + d);
    };
    return costate_json({"gradient", kFiveBar, "--no-files", "--rtol", "1e-11", "--set",
                         "spring.S1.natural_length_m=" + value("L01", dL01), "--set",
                         "spring.S2.natural_length_m=" + value("L02", dL02)},
                        here.path())
        .at("gradient");
  };
  const double h = 1e-3;
  double H[2][2];
  for (const int k : {0, 1}) {
    const Json up = gradient_at(k == 0 ? h : 0, k == 1 ? h : 0), down = gradient_at(k == 0 ? -h : 0, k == 1 ? -h : 0);
    int i = 0;
    for (const char* name : {"L01", "L02"})
      H[i++][k] = (up.at(name).get<double>() - down.at(name).get<double>()) / (2 * h);
  }
  const auto [least, largest] = eigenvalues(H[0][0], (H[0][1] + H[1][0]) / 2, H[1][1]);
  CHECK(e[0] == Approx(least).epsilon(1e-3));
  CHECK(e[1] == Approx(largest).epsilon(1e-3));
  // The summary on disk holds it as well.
  CHECK(Json::parse(file_text(here / "out/optimize.json")).at("certificate").at("verdict") == c.at("verdict"));
}

TEST_CASE("certificate: left out on request, and the evaluations do not depend on it") {
  const WorkingDirectory here;
  const Json with = costate_json({"optimize", kFiveBar, "--no-files"}, here.path());
  const Json without = costate_json({"optimize", kFiveBar, "--no-files", "--no-certificate"}, here.path());
  CHECK(with.contains("certificate"));
  CHECK_FALSE(without.contains("certificate"));
  Json tables[2] = {with.at("evaluations"), without.at("evaluations")};
  for (Json& table : tables)
    for (Json& row : table) row.erase("wall_s");
  CHECK(tables[0] == tables[1]);
  CHECK(with.at("psi") == without.at("psi"));
}

TEST_CASE("certificate: an active bound has a multiplier, which is what the bound costs") {
  const WorkingDirectory here;
  const auto bounded = [&](const std::string& lower) {
    return costate_json({"optimize", kFiveBar, "--no-files", "--set", "parameter.L02.lower=" + lower}, here.path());
  };
  const Json j = bounded("1.9"), moved = bounded("1.901");
  const Json& c = certificate_of(j);
  CHECK_THAT(verdict_of(j), Contains("strict local minimum"));
  CHECK(c.at("active") == Json({"L02.lower"}));
  CHECK(c.at("free") == Json({"L01"}));
  CHECK(c.at("hessian_eigenvalues").size() == 1);
  const double multiplier = c.at("multipliers").at("L02.lower").get<double>();
  CHECK(multiplier > 0);
  CHECK(multiplier == Approx(j.at("gradient").at("L02").get<double>()));
  // The least psi grows by the multiplier times the bound's way, up to half the way times the curvature.
  CHECK((moved.at("psi").get<double>() - j.at("psi").get<double>()) / 1e-3 == Approx(multiplier).epsilon(0.05));
}

TEST_CASE("certificate: an active constraint has a multiplier") {
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
      {"optimize", "scene.toml", "--no-files", "--algorithm", "slsqp", "--max-evaluations", "300"}, here.path());
  const Json& c = certificate_of(j);
  INFO(c.dump(1));
  CHECK(c.at("active") == Json({"constraint.impulse"}));
  const double multiplier = c.at("multipliers").at("constraint.impulse").get<double>();
  CHECK(multiplier > 0);
  CHECK(c.at("hessian_eigenvalues").size() == 1);  // two parameters, one direction left
  // dL/dx = 0: the gradients of cost and constraint are opposite, by the multiplier.
  CHECK(c.at("kkt_residual").get<double>() <= c.at("kkt_tolerance").get<double>());
  CHECK_THAT(verdict_of(j), Contains("strict local minimum"));
}

TEST_CASE("certificate: a bound that the optimizer missed by a rounding is active") {
  const WorkingDirectory here;
  // At this bound SLSQP ends 9e-15 inside (NLopt 2.7.1 on x86-64).
  const Json j = costate_json({"optimize", kFiveBar, "--no-files", "--algorithm", "slsqp", "--stop-value=-1", "--set",
                               "parameter.L02.lower=1.9771"},
                              here.path());
  CHECK(j.at("parameters").at("L02").get<double>() == Approx(1.9771).epsilon(1e-12));
  CHECK(certificate_of(j).at("active") == Json({"L02.lower"}));
  CHECK_THAT(verdict_of(j), Contains("strict local minimum"));
}

TEST_CASE("certificate: a run that was cut short is not stationary") {
  const WorkingDirectory here;
  const Json j = costate_json({"optimize", kFiveBar, "--no-files", "--max-evaluations", "2"}, here.path());
  CHECK_THAT(verdict_of(j), Contains("not stationary"));
  CHECK(certificate_of(j).at("kkt_residual").get<double>() > certificate_of(j).at("kkt_tolerance").get<double>());
}

TEST_CASE("certificate: a formulation without Hessians borrows one, and says so") {
  const WorkingDirectory here;
  for (const auto& [formulation, method] : {std::pair<std::string, std::string>{"index2", "idas-adjoint"},
                                            std::pair<std::string, std::string>{"maggi", "cvodes-adjoint"}}) {
    INFO(formulation);
    const Json j = costate_json({"optimize", kFiveBar, "--no-files", "--formulation", formulation, "--method", method},
                                here.path());
    CHECK(certificate_of(j).at("hessian_formulation") == "baumgarte");
    CHECK_THAT(certificate_of(j).at("hessian_note").get<std::string>(), Contains(formulation) && Contains("baumgarte"));
    CHECK_THAT(verdict_of(j), Contains("strict local minimum"));
  }
  for (const std::string formulation : {"baumgarte", "penalty", "augmented-lagrangian"}) {
    INFO(formulation);
    const Json j = costate_json(
        {"optimize", kFiveBar, "--no-files", "--formulation", formulation, "--method", "cvodes-adjoint"}, here.path());
    CHECK(certificate_of(j).at("hessian_formulation") == formulation);
    CHECK_THAT(verdict_of(j), Contains("strict local minimum"));
  }
}

TEST_CASE("certificate: parameters that make no difference leave the Hessian singular") {
  // Every choice of springs and masses that is in equilibrium at the start has psi = 0: two conditions on
  // eight.
  const WorkingDirectory here;
  const Json j =
      costate_json({"optimize", kFiveBar, "--no-files", "--parameters", "L01,L02,k1,k2,m1,m2,m3,m4"}, here.path());
  const Json& c = certificate_of(j);
  CHECK_THAT(verdict_of(j), Contains("Hessian singular: 6 of its 8 eigenvalues are zero"));
  CHECK(c.at("newton_step").is_null());
  const auto e = c.at("hessian_eigenvalues").get<std::vector<double>>();
  REQUIRE(e.size() == 8);
  for (std::size_t i = 0; i < 8; ++i) CHECK((e[i] > c.at("eigenvalue_tolerance").get<double>()) == (i >= 6));
}

TEST_CASE("certificate: a maximum in the way is no minimum") {
  // -psi has its maximum where psi has its minimum; a start there is stationary, and L-BFGS stops at once.
  const WorkingDirectory here;
  std::string scene = file_text(kFiveBar);
  for (std::size_t at = scene.find("kind = \"square\""); at != std::string::npos;
       at = scene.find("kind = \"square\"", at + 30))
    scene.insert(at, "weight = -1\n");
  write_text(here / "scene.toml", scene);
  const Json j = costate_json(
      {"optimize", "scene.toml", "--no-files", "--stop-value", "1", "--set",
       "spring.S1.natural_length_m=2.4319235745745838", "--set", "spring.S2.natural_length_m=1.8448688868053879"},
      here.path());
  CHECK_THAT(verdict_of(j), Contains("stationary, Hessian indefinite") && !Contains("not stationary"));
  CHECK(certificate_of(j).at("largest_eigenvalue").get<double>() < 0);
}

TEST_CASE("certificate: what is touched without a multiplier holds nothing") {
  // A point that rests where its parameters a and b put it, started at a = b = 0, where each psi is stationary.
  const WorkingDirectory here;
  const auto judged = [&](const std::string& cost, const std::string& lower, const std::string& constraint) {
    std::string scene =
        "[gravity]\ny_m_per_s2 = 0\n[point.P]\nx_m = 0\ny_m = 0\n[mass.m]\npoint = \"P\"\nmass_kg = 1\n";
    for (const std::string coordinate : {"x", "y"})
      scene += "[parameter." + std::string(coordinate == "x" ? "a" : "b") + "]\nnumber = \"point.P." + coordinate +
               "_m\"\nlower = " + lower + "\nupper = 1\nscale = 1\n";
    scene +=
        "[output.along]\nformula = \"P.x + P.y\"\nunit = \"m\"\n[output.across]\nformula = \"P.x - P.y\"\nunit = "
        "\"m\"\n";
    scene += cost + "[run]\nt_end_s = 1\nparameters = [\"a\", \"b\"]\n[optimize]\nalgorithm = \"slsqp\"\n" + constraint;
    write_text(here / "scene.toml", scene);
    const Json j = costate_json({"optimize", "scene.toml", "--no-files", "--stop-value=-10", "--max-evaluations", "1"},
                                here.path());
    INFO(certificate_of(j).dump(1));
    CHECK(j.at("parameters").at("a") == 0);
    CHECK(j.at("parameters").at("b") == 0);
    return verdict_of(j);
  };
  const auto square = [](const std::string& output, const std::string& weight) {
    return "[[cost.terminal]]\nkind = \"square\"\noutput = \"" + output + "\"\nweight = " + weight + "\n";
  };
  const std::string b_not_below_zero =
      "[[optimize.constraint]]\nname = \"floor\"\nupper = 0\n[[optimize.constraint.terminal]]\nkind = "
      "\"value\"\noutput = \"P.y\"\nweight = -1\n";
  // a^2 - b^2: falls as b grows, which b >= 0 does not forbid; likewise as a constraint and as a bound.
  const std::string saddle = square("P.x", "1") + square("P.y", "-1");
  CHECK_THAT(judged(saddle, "-1", b_not_below_zero), Contains("stationary, Hessian indefinite"));
  CHECK_THAT(judged(saddle, "0", ""), Contains("stationary, Hessian indefinite"));
  // a^2 + b^2 has its minimum there, with or without.
  CHECK_THAT(judged(square("P.x", "1") + square("P.y", "1"), "-1", b_not_below_zero), Contains("strict local minimum"));
  // 4 a b = (a + b)^2 - (a - b)^2 in the corner a, b >= 0, where it is at its least: it falls along a = -b alone,
  // which leaves the corner either way. Second derivatives alone do not tell.
  const std::string corner = square("along", "1") + square("across", "-1");
  CHECK_THAT(judged(corner, "0", ""), Contains("whether this is a minimum is not known"));
  CHECK_THAT(judged(corner, "-1", ""), Contains("stationary, Hessian indefinite"));
}

TEST_CASE("certificate: redundant rows take a formulation that carries them") {
  const WorkingDirectory here;
  // A swing board on three parallel ropes: one too many.
  std::string scene = R"([gravity]
y_m_per_s2 = -9.81

[body.board]
x_m = 0.6
y_m = -0.8
mass_kg = 2
inertia_kg_m2 = 0.4

[start]
given = ["board.x"]

[[cost.running]]
kind = "square"
output = "board.x"

[parameter.mass]
number = "body.board.mass_kg"
lower = 0.5
upper = 5

[parameter.start]
number = "body.board.x_m"
lower = 0.1
upper = 0.9

[run]
t_end_s = 1
parameters = ["mass", "start"]

[optimize]
algorithm = "lbfgs"
)";
  int k = 0;
  for (const std::string x : {"-0.3", "0", "0.5"}) {
    const std::string i = std::to_string(++k);
    scene += "[point.G" + i + "]\nground = true\nx_m = " + x + "\ny_m = 0\n";
    scene += "[point.E" + i + "]\non = \"board\"\nx_m = " + x + "\ny_m = 0\n";
    scene += "[distance.rope" + i + "]\nfrom = \"G" + i + "\"\nto = \"E" + i + "\"\nlength_m = 1\n";
  }
  write_text(here / "scene.toml", scene);
  const Json j = costate_json({"optimize", "scene.toml", "--no-files", "--formulation", "maggi", "--method",
                               "cvodes-adjoint", "--max-evaluations", "1"},
                              here.path());
  const Json& c = certificate_of(j);
  INFO(c.dump(1));
  CHECK(c.at("hessian_formulation") == "augmented-lagrangian");
  CHECK_THAT(c.at("hessian_note").get<std::string>(), Contains("redundant rows (distance.rope"));
  CHECK(c.at("hessian_eigenvalues").size() == 2);
}

TEST_CASE("certificate: for people") {
  const WorkingDirectory here;
  const Outcome o = run_costate({"optimize", kFiveBar, "--no-files", "--set", "parameter.L02.lower=1.9"}, here.path());
  CHECK(o.status == 0);
  CHECK_THAT(o.out, Contains("strict local minimum: ") && Contains("L02.lower is active: multiplier ") &&
                        Contains("Hessian in scaled parameters: "));
}

TEST_CASE("certificate: steps of differences stay within bounds that are nearer than these") {
  // A mass at rest on its spring at k = g/0.2 = 49.05 N/m, where psi, an integral of a square, is zero. Steps of 4e-3
  // of this scale lead to negative stiffnesses, with which the mass runs away: eigenvalues were -4e117.
  const WorkingDirectory here;
  write_text(here / "rest.toml", R"([gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0
y_m = -1.2
[mass.m]
point = "P"
mass_kg = 1
[spring.s]
from = "A"
to = "P"
stiffness_N_per_m = 40
natural_length_m = 1
damping_N_s_per_m = 1
[start]
given = ["P.x", "P.y"]
[[cost.running]]
kind = "square"
output = "P.y_ddot"
[parameter.k]
number = "spring.s.stiffness_N_per_m"
lower = 10
upper = 100
scale = 1e6
[parameter.c]
number = "spring.s.damping_N_s_per_m"
lower = 0.1
upper = 20
[run]
t_end_s = 2
parameters = ["k", "c"]
)");
  const Json j = costate_json({"optimize", "rest.toml", "--output", "out"}, here.path());
  CHECK(j.at("parameters").at("k").get<double>() == Approx(49.05).epsilon(1e-6));
  CHECK_THAT(verdict_of(j), Contains("Hessian singular"));  // c makes no difference at rest
  const Json& c = certificate_of(j);
  // 2 integral of (d(y'')/dk)^2 dt, by quadrature (scipy) of the closed form for m = 1, c = 1 and a load of 0.2 m:
  const double expected = 1e12 * 0.034658751;
  CHECK(c.at("largest_eigenvalue").get<double>() == Approx(expected).epsilon(0.05));  // known to 2e-2, it says
  CHECK(c.at("eigenvalue_error").get<double>() < 0.1 * expected);  // four times what extrapolation changes
}

TEST_CASE("certificate: a minimum on a kink of psi is told as that") {
  // |x| + v^2 with x and v at the end by a push a + b t: least where both are 0, of slopes of either sign.
  const WorkingDirectory here;
  write_text(here / "k.toml", R"toml([point.P]
x_m = 0
y_m = 0
[mass.m]
point = "P"
mass_kg = 1
[force.f]
point = "P"
formula_x_N = "a + b*t"
a = -0.45
b = 0.45
[start]
given = ["P.x", "P.y"]
[output.c]
formula = "abs(P.x) + P.x_dot^2"
unit = "1"
[[cost.terminal]]
kind = "value"
output = "c"
[parameter.a]
number = "force.f.a"
scale = 1
[parameter.b]
number = "force.f.b"
scale = 1
[run]
t_end_s = 2
rtol = 1e-9
parameters = ["a", "b"]
)toml");
  const Json j = costate_json({"optimize", "k.toml", "--no-files"}, here.path());
  INFO(verdict_of(j));
  CHECK(j.at("psi").get<double>() < 1e-4);
  CHECK_THAT(verdict_of(j), Contains("kink") && !Contains("another motion"));
}
