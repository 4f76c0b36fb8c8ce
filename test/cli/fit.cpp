// costate fit: parameters that are known come back within their intervals; what the data do not tell is said; mistakes.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "process.h"
#include "support/paths.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

const std::string kFolder = COSTATE_MODELS_DIR "/identification/";

void check_holds(const Json& fit, const std::string& parameter, double truth) {
  INFO(parameter << " " << fit["parameters"][parameter].dump());
  const Json& interval = fit["parameters"][parameter]["confidence_interval"];
  CHECK(interval[0].get<double>() < truth);
  CHECK(truth < interval[1].get<double>());
}

}  // namespace

TEST_CASE("fit: the pendulum's truth lies within the intervals of two runs at once", "[fit]") {
  const WorkingDirectory here;
  const Json j = costate_json({"fit", kFolder + "pendulum.toml", "--with", kFolder + "pendulum_wide.toml",
                               "--confidence", "0.99", "--output", "out"},
                              here.path());
  CHECK(j["status"] == "ok");
  const double pi = std::acos(-1.0);
  check_holds(j, "length", 0.53);
  check_holds(j, "damping", 0.02);
  check_holds(j, "released", 0.6 - pi / 2);
  check_holds(j, "released_wide", 1.9 - pi / 2);
  // Two runs of 5 s tell a length to a tenth of a percent and a damping to some percent.
  CHECK(j["parameters"]["length"]["standard_error"].get<double>() < 5e-4);
  CHECK(j["parameters"]["damping"]["standard_error"].get<double>() < 1e-3);
  // The mean of N - p squares of normal residuals is 1 -+ sqrt(2/(N - p)); five of these.
  const double dof = j["degrees_of_freedom"];
  CHECK(dof == 201 + 251 - 4);
  CHECK(std::abs(j["reduced_chi_square"].get<double>() - 1) < 5 * std::sqrt(2 / dof));
  CHECK(j["identifiability"].empty());
  REQUIRE(j["data"].size() == 2);
  CHECK(j["data"][0]["samples"] == 201);
  CHECK(j["covariance"].size() == 4);
  CHECK(std::abs(j["correlation"][0][0].get<double>() - 1) < 1e-12);
  // The scene that is written begins where the fit ended, and finds its file from there.
  const Json again = costate_json({"fit", "out/fitted.toml", "--with", "out/fitted_2.toml", "--no-files"}, here.path());
  // An error of 100 rtol = 1e-6 rad is 1e-4 sigma.
  CHECK(std::abs(again["start_chi_square"].get<double>() / j["chi_square"].get<double>() - 1) < 1e-4);
}

TEST_CASE("fit: worn dampers of the Iltis lie within the intervals of a four-post record", "[fit]") {
  // The record is of another formulation and integrator, with the slopes of models/identification/make_iltis_data.py.
  const WorkingDirectory here;
  const Json j =
      costate_json({"fit", kFolder + "iltis_four_post.toml", "--confidence", "0.99", "--no-files"}, here.path());
  CHECK(j["status"] == "ok");
  check_holds(j, "c1", 8200);
  check_holds(j, "c2", 11400);
  // Noise of half a millimetre on travels of some centimetres over 2 s tells a damper to some percent, and tells these
  // from the data sheet's.
  CHECK(j["parameters"]["c1"]["standard_error"].get<double>() < 0.02 * 8200);
  CHECK(j["parameters"]["c2"]["standard_error"].get<double>() < 0.02 * 11400);
  CHECK(j["parameters"]["c1"]["confidence_interval"][1].get<double>() < 9945.627);
  CHECK(j["parameters"]["c2"]["confidence_interval"][0].get<double>() > 9945.627);
  const double dof = j["degrees_of_freedom"];
  CHECK(dof == 5 * 201 - 2);
  CHECK(std::abs(j["reduced_chi_square"].get<double>() - 1) < 5 * std::sqrt(2 / dof));
  CHECK(j["identifiability"].empty());
}

// A turned disk on a spring, in closed form, with errors of the size of sigma that have no trend. At rtol 1e-8 the
// damping was six of its standard errors off, in silence; and an angular velocity that is zero but for these errors, or
// small against its scale, was "not identified".
TEST_CASE("fit: errors of integration are told, and a parameter near zero keeps its interval", "[fit]") {
  const WorkingDirectory here;
  const double k = 900, c = 0.02, a = 0.5, sigma = 1e-5, rate = c / 2, w = std::sqrt(k - rate * rate);
  const auto angle = [&](double t, double v) {
    return std::exp(-rate * t) * (a * std::cos(w * t) + (v + rate * a) / w * std::sin(w * t));
  };
  std::string exact = "t,a [rad]\n", coarse = exact;
  for (int i = 1; i <= 1000; ++i) {
    const double noise = std::sqrt(2.0) * std::sin(0.7 * i * i), t = 0.04 * i;
    exact += fmt::format("{},{}\n", t, angle(t, 0) + sigma * noise);
    if (i <= 250) coarse += fmt::format("{},{}\n", t, angle(t, 0.02) + 1e-3 * noise);
  }
  const auto write = [&](const std::string& name, const std::string& data, const char* sigmas, const char* t_end) {
    write_text(here.path() / (name + ".csv"), data);
    write_text(here.path() / (name + ".toml"), fmt::format(R"(
[body.disk]
x_m = 0
y_m = 0
angle_rad = 0.49
mass_kg = 1
inertia_kg_m2 = 1
[point.axle]
ground = true
x_m = 0
y_m = 0
[point.centre]
on = "disk"
x_m = 0
y_m = 0
[revolute.axle]
points = ["axle", "centre"]
[torsion_spring.shaft]
angle = "disk"
stiffness_N_m_per_rad = 900.3
damping_N_m_s_per_rad = 0.03
[start]
given = ["disk.angle"]
[data.d]
file = "{}.csv"
[[cost.samples]]
data = "d"
column = "a"
output = "disk.angle"
sigma = {}
[parameter.k]
number = "torsion_spring.shaft.stiffness_N_m_per_rad"
[parameter.c]
number = "torsion_spring.shaft.damping_N_m_s_per_rad"
[parameter.a]
number = "body.disk.angle_rad"
[parameter.v]
number = "body.disk.angular_velocity_rad_per_s"
[run]
t_end_s = {}
parameters = ["k", "c", "a"{}]
)",
                                                           name, sigmas, t_end, name == "coarse" ? ", \"v\"" : ""));
  };
  write("exact", exact, "1e-5", "40");
  write("coarse", coarse, "1e-3", "10");
  const auto off = [](const Json& fit, const char* name, double truth) {
    const Json& p = fit["parameters"][name];
    return std::abs(p["value"].get<double>() - truth) / p["standard_error"].get<double>();
  };
  const Json loose = costate_json({"fit", "exact.toml", "--no-files"}, here.path());
  CHECK(off(loose, "c", c) > 3);  // of what the data would tell
  check_holds(loose, "k", k);
  check_holds(loose, "c", c);
  check_holds(loose, "a", a);
  CHECK_THAT(loose["warnings"].dump(), Contains("Errors of integration move 'c'"));
  const Json tight = costate_json({"fit", "exact.toml", "--no-files", "--rtol", "1e-11"}, here.path());
  CHECK(off(tight, "c", c) < 3);
  CHECK(tight["warnings"].empty());
  for (const char* rtol : {"1e-6", "1e-8"}) {
    const Json j = costate_json({"fit", "coarse.toml", "--no-files", "--rtol", rtol}, here.path());
    CHECK(j["parameters"]["v"]["identified"] == true);
    check_holds(j, "v", 0.02);
  }
  // An interval holds its own value to its last digit.
  const auto text = run_costate({"fit", "exact.toml", "--no-files", "--rtol", "1e-11"}, here.path()).out;
  CHECK_THAT(text, !Contains("900 ... 900"));
}

TEST_CASE("fit: what the data do not tell is said", "[fit]") {
  const WorkingDirectory here;
  const std::string scene = kFolder + "pendulum.toml";
  // Only damping/(m L^2) and g/L act.
  const Json j = costate_json({"fit", scene, "--parameters", "mass.bob.mass_kg,damping,length,released", "--no-files"},
                              here.path());
  REQUIRE(j["identifiability"].size() >= 1);
  const std::string words = j["identifiability"][0];
  CHECK_THAT(words, Contains("'mass.bob.mass_kg', 'damping' are not identified"));
  CHECK(j["parameters"]["damping"]["standard_error"].is_null());
  CHECK(j["parameters"]["length"]["identified"] == true);
  CHECK(j["parameters"]["length"]["standard_error"].get<double>() > 0);
  // A bound that is in the way.
  const Json bound = costate_json({"fit", scene, "--set", "parameter.length.upper=0.5", "--no-files"}, here.path());
  CHECK(bound["parameters"]["length"]["value"] == 0.5);
  CHECK(bound["parameters"]["length"]["at_bound"] == true);
  CHECK_THAT(bound["identifiability"].dump(), Contains("has come to its bound 0.5"));
  CHECK_THAT(bound["identifiability"].dump(), Contains("times as large as the given sigmas say"));
}

// What parameters are told apart by does not depend on their sizes: an oscillator's two dampers act alike, however
// small the one is; of a motion that is measured once stiffness and damping are one number.
TEST_CASE("fit: what acts alike is told whatever its size", "[fit]") {
  const WorkingDirectory here;
  std::string rows = "t,x\n";
  for (int i = 0; i <= 60; ++i) {
    const double t = 0.05 * i;
    rows += std::to_string(t) + "," + std::to_string(std::exp(-0.12 * t) * std::cos(2 * t)) + "\n";
  }
  write_text(here / "run.csv", rows);
  write_text(here / "once.csv", "t,x\n0,1\n3,0.6\n");
  write_text(here / "one.csv", "t,x\n3,0.6\n");
  write_text(here / "s.toml", R"(
[point.P]
x_m = 1
y_m = 0
[point.W]
ground = true
x_m = -5
y_m = 0
[mass.m]
point = "P"
mass_kg = 2
[spring.S]
from = "W"
to = "P"
stiffness_N_per_m = 7.9
natural_length_m = 5
damping_N_s_per_m = 0.48
[force.extra]
point = "P"
formula_x_N = "-d*P.x_dot"
d = 1e-6
[data.r]
file = "run.csv"
[start]
given = ["P.x", "P.y"]
[[cost.samples]]
data = "r"
column = "x"
output = "P.x"
sigma = 0.02
[parameter.k]
number = "spring.S.stiffness_N_per_m"
[parameter.c]
number = "spring.S.damping_N_s_per_m"
[parameter.d]
number = "force.extra.d"
[run]
t_end_s = 3
parameters = ["k", "c", "d"]
)");
  for (const char* d : {"1e-9", "1e-6", "1e-3", "0.2"}) {
    CAPTURE(d);
    const Json j =
        costate_json({"fit", "s.toml", "--no-files", "--set", std::string("force.extra.d=") + d}, here.path());
    CHECK(j["parameters"]["k"]["identified"] == true);
    CHECK(j["parameters"]["c"]["identified"] == false);
    CHECK(j["parameters"]["c"]["standard_error"].is_null());
    CHECK(j["parameters"]["d"]["identified"] == false);
    CHECK_THAT(j["identifiability"].dump(), Contains("'c', 'd' are not identified") && Contains("as 1 : -1"));
  }
  const Json once = costate_json(
      {"fit", "s.toml", "--no-files", "--parameters", "k,c", "--set", "data.r.file=once.csv"}, here.path());
  CHECK(once["parameters"]["k"]["identified"] == false);
  CHECK(once["parameters"]["c"]["identified"] == false);
  CHECK_THAT(once["identifiability"].dump(), Contains("'k', 'c' are not identified"));
  const Json one =
      costate_json({"fit", "s.toml", "--no-files", "--parameters", "k,c", "--set", "data.r.file=one.csv"}, here.path());
  CHECK_THAT(one["identifiability"].dump(), Contains("1 residuals are too few for 2 parameters"));
  CHECK(one["identifiability"].dump().find("are not identified") == std::string::npos);
}

TEST_CASE("fit: numbers that no scene may have are told with the result, and no scene of them is written", "[fit]") {
  // x = 0.3 exp(0.05 t) cos(4 t): a motion that grows, as of a damping of -0.1 N s/m; it was an error behind all work.
  const WorkingDirectory here;
  std::string rows;
  for (int i = 1; i <= 40; ++i) {
    const double t = 0.05 * i;
    rows += fmt::format("{}[{:.4g}, {:.12g}]", i > 1 ? ", " : "", t, 1 + 0.3 * std::exp(0.05 * t) * std::cos(4 * t));
  }
  write_text(here / "grows.toml", R"([point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1.3
y_m = 0
vx_m_per_s = 0.015
[mass.m]
point = "P"
mass_kg = 1
[spring.s]
from = "A"
to = "P"
stiffness_N_per_m = 15
natural_length_m = 1
damping_N_s_per_m = 0.2
[data.r]
columns = ["t", "x"]
rows = [)" + rows + R"(]
[start]
given = ["P.x", "P.y"]
[[cost.samples]]
data = "r"
column = "x"
output = "P.x"
sigma = 0.01
[parameter.k]
number = "spring.s.stiffness_N_per_m"
[parameter.c]
number = "spring.s.damping_N_s_per_m"
[run]
t_end_s = 2
parameters = ["k", "c"]
)");
  // y'' + c y' + k y = 0 has c = -0.1, k = 16 + 0.05^2.
  const Json j = costate_json({"fit", "grows.toml", "--output", "out"}, here.path());
  CHECK(j["parameters"]["c"]["value"].get<double>() == Approx(-0.1).epsilon(1e-5));
  CHECK(j["parameters"]["k"]["value"].get<double>() == Approx(16.0025).epsilon(1e-6));
  CHECK_THAT(j["warnings"].dump(), Contains("no scene may have") && Contains("must not be negative"));
  CHECK_FALSE(std::filesystem::exists(here / "out/fitted.toml"));
}

TEST_CASE("fit: a search that does not move says so", "[fit]") {
  // x^2 after t with the speed v, of which data tell v = 2 but for its sign: v = 0 is stationary, and no minimum.
  const WorkingDirectory here;
  const auto fit_from = [&](double v) {
    write_text(here.path() / "s.toml", fmt::format(R"([point.P]
x_m = 0
y_m = 0
vx_m_per_s = {}
[mass.m]
point = "P"
mass_kg = 1
[start]
given = ["P.x", "P.y"]
[output.square]
formula = "P.x^2"
unit = "1"
[data.d]
columns = ["t [s]", "x2 [1]"]
rows = [[0.25, 0.2501], [0.5, 0.9999], [1, 4.0001]]
[[cost.samples]]
data = "d"
column = "x2"
output = "square"
sigma = 1e-4
[parameter.v]
number = "point.P.vx_m_per_s"
scale = 1
[run]
t_end_s = 1
parameters = ["v"]
)",
                                                   v));
    return costate_json({"fit", "s.toml", "--no-files"}, here.path());
  };
  CHECK_THAT(fit_from(0).at("warnings").dump(), Contains("ended where it began"));
  const Json moved = fit_from(1);
  CHECK(moved.at("warnings").dump().find("ended where it began") == std::string::npos);
  CHECK(moved.at("parameters").at("v").at("value").get<double>() == Approx(2).epsilon(1e-3));
}

TEST_CASE("fit: mistakes", "[fit]") {
  const WorkingDirectory here;
  const std::string scene = kFolder + "pendulum.toml";
  const auto complaint = [&](const std::vector<std::string>& words) {
    const auto r = run_costate(words, here.path());
    CHECK(r.status != 0);
    return r.err;
  };
  CHECK_THAT(complaint({"fit", COSTATE_MODELS_DIR "/five_bar/five_bar.toml", "--no-files"}),
             Contains("[[cost.samples]]"));
  CHECK_THAT(complaint({"fit", scene, "--confidence", "2", "--no-files"}), Contains("--confidence"));
  CHECK_THAT(complaint({"fit", scene, "--t-end", "3", "--no-files"}), Contains("outside the run from 0 to 3 s"));
  // The library that searches said of it that a "ParameterBlock has at least one infeasible bound".
  CHECK_THAT(complaint({"fit", scene, "--no-files", "--set", "parameter.damping.lower=0.05", "--set",
                        "parameter.damping.upper=0.05"}),
             Contains("'damping' has nowhere to go between its bounds"));
  write_text(here / "more.toml",
             "include = [\"" + scene + "\"]\n[[cost.running]]\nkind = \"square\"\noutput = \"P.x\"\n");
  CHECK_THAT(complaint({"fit", "more.toml", "--no-files"}), Contains("Only sums of squares at samples"));
}
