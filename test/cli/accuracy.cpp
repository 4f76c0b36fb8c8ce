// A result's accuracy in the place of tolerances: what is asked for is met, said, or refused.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "five_bar.h"
#include "process.h"
#include "support/paths.h"

using Catch::Contains;
using namespace costate::test;
using Json = nlohmann::json;

namespace {

const std::string kModels = COSTATE_SOURCE_DIR "/models/";

Json gradient_of(const std::string& scene, std::vector<std::string> options, const WorkingDirectory& here) {
  options.insert(options.begin(), {"gradient", scene, "--no-files"});
  return costate_json(options, here.path());
}

/// The larger of psi's error against itself and of the derivatives' in the scales of their parameters.
double error_of(const Json& run, const Json& right) {
  double size = 0, error = 0;
  for (const auto& [name, value] : right["gradient"].items()) {
    const double scale = std::max(std::abs(right["parameters"][name].get<double>()), 1e-9);
    size = std::max(size, std::abs(value.get<double>()) * scale);
    error = std::max(error, std::abs(run["gradient"][name].get<double>() - value.get<double>()) * scale);
  }
  const double psi = right["psi"].get<double>();
  return std::max(error / size, std::abs(run["psi"].get<double>() - psi) / std::abs(psi));
}

// One crank, one rocker, gravity; a chaotic motion behind some ten seconds.
const char* kDoublePendulum = R"(
[gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.A]
x_m = 0.6
y_m = 0.8
[point.B]
x_m = 1.5
y_m = 1.2
[bar.upper]
from = "O"
to = "A"
mass_kg = 1
[bar.lower]
from = "A"
to = "B"
mass_kg = 1
[start]
given = ["A.x", "B.x"]
[[cost.terminal]]
kind = "value"
output = "B.x"
[parameter.m]
number = "bar.lower.mass_kg"
[run]
t_end_s = 100
parameters = ["m"]
)";

}  // namespace

// The truth: Baumgarte on CVODES at rtol 1e-13, a combination that may be the choice, and index 2 on IDAS, which is
// none.
TEST_CASE("accuracy: what is asked for is met", "[accuracy]") {
  const WorkingDirectory here;
  int within = 0, all = 0;
  for (const std::string scene : {"five_bar/five_bar.toml", "slider_crank/slider_crank.toml", "andrews/andrews.toml"}) {
    const Json right = gradient_of(
        kModels + scene, {"--formulation", "baumgarte", "--method", "cvodes-adjoint", "--rtol", "1e-13"}, here);
    const Json other =
        gradient_of(kModels + scene, {"--formulation", "index2", "--method", "idas-adjoint", "--rtol", "1e-11"}, here);
    REQUIRE(error_of(other, right) < 1e-8);
    for (const std::string accuracy : {"1e-2", "1e-3", "1e-4", "1e-5", "1e-6", "1e-7"}) {
      CAPTURE(scene, accuracy);
      const Json run = gradient_of(kModels + scene, {"--accuracy", accuracy}, here);
      const double error = error_of(run, right), a = std::stod(accuracy);
      CHECK(run["accuracy"]["met"] == true);
      CHECK(run["accuracy"]["estimated"].get<double>() <= a);
      // The claim of the page: nineteen in twenty within the request, none beyond five times it.
      CHECK(error <= 5 * a);
      within += error <= a;
      ++all;
      // The estimates of the parts are of psi and of each derivative.
      CHECK(std::abs(run["psi"].get<double>() - right["psi"].get<double>()) <= 5 * run["psi_error"].get<double>());
    }
  }
  CAPTURE(within, all);
  CHECK(20 * within >= 19 * all - 20);  // one miss more of so few
}

TEST_CASE("accuracy: a simulation records the run that meets it", "[accuracy]") {
  const WorkingDirectory here;
  const Json run = costate_json({"simulate", kFiveBar, "--accuracy", "1e-6", "--output", "out"}, here.path());
  CHECK(run["accuracy"]["met"] == true);
  CHECK(run["accuracy"]["outputs_error"].get<double>() <= 1e-6);
  CHECK(run["accuracy"]["rtol"] == run["rtol"]);
  CHECK(run["accuracy"]["pilots"].size() >= 1);
  // Where no pilot is done in next to no time there is one on each integrator.
  const Json raced =
      costate_json({"simulate", kModels + "iltis/speed_bumps.toml", "--accuracy", "1e-3", "--no-files"}, here.path());
  CHECK(raced["accuracy"]["pilots"].size() >= 3);
  // The stored end is that of the same settings, to the last digit.
  const Json same = costate_json({"simulate", kFiveBar, "--formulation", run["formulation"].get<std::string>(),
                                  "--integrator", run["integrator"].get<std::string>(), "--rtol", run["rtol"].dump(),
                                  "--atol", run["accuracy"]["atol"].dump(), "--no-files"},
                                 here.path());
  CHECK(same["psi"] == run["psi"]);
  CHECK(same["terminal"] == run["terminal"]);
  // As an entry of the scene it does the same, but not beside a tolerance; one on the command line overrides it.
  write_text(here.path() / "crank.toml", std::string(kDoublePendulum) + "accuracy = 1e-3\n");
  CHECK(gradient_of("crank.toml", {"--t-end", "1"}, here)["accuracy"]["asked"] == 1e-3);
  CHECK(!gradient_of("crank.toml", {"--t-end", "1", "--rtol", "1e-5"}, here).contains("accuracy"));
  const auto both = run_costate({"gradient", "crank.toml", "--set", "run.rtol=1e-5"}, here.path());
  CHECK(both.status != 0);
  CHECK_THAT(both.err, Contains("exclude each other"));
}

TEST_CASE("accuracy: explicit schemes take part", "[accuracy]") {
  const WorkingDirectory here;
  const Json run = gradient_of(kFiveBar, {"--accuracy", "1e-6"}, here);
  int schemes = 0;
  for (const Json& p : run["accuracy"]["pilots"]) schemes += p["integrator"] == "dop853" ? 1 : 0;
  CHECK(schemes >= 1);
  // By the derivative of their steps, where that is asked for; fixed steps follow no tolerance.
  const Json right = gradient_of(kFiveBar, {"--method", "cvodes-forward", "--rtol", "1e-12"}, here);
  for (const std::string integrator : {"dopri5", "dop853"}) {
    const Json own =
        gradient_of(kFiveBar, {"--accuracy", "1e-6", "--method", "discrete-adjoint", "--integrator", integrator}, here);
    CAPTURE(integrator);
    CHECK(own["accuracy"]["met"] == true);
    CHECK(own["integrator"] == integrator);
    CHECK(error_of(own, right) <= 5e-6);
  }
  const auto fixed = run_costate({"gradient", kFiveBar, "--no-files", "--accuracy", "1e-6", "--formulation", "index3",
                                  "--method", "discrete-adjoint", "--integrator", "fixed"},
                                 here.path());
  CHECK(fixed.status != 0);
}

TEST_CASE("accuracy: two loose runs that agree by chance do not do", "[accuracy]") {
  const WorkingDirectory here;
  // Over stick and slip, runs at rtol 2e-3 and 2e-4 agree to 5e-3 and are both a tenth off.
  write_text(here / "sticky.toml", "include = [\"" + kModels + "slider_crank/slider_crank.toml" + R"("]
[body.crank]
angle_rad = 1.0810419283195745
inertia_kg_m2 = 1.317468099133586
angular_velocity_rad_per_s = -0.9474211586282375
[body.rod]
mass_kg = 0.8974058232324883
inertia_kg_m2 = 2.8335323311005514
[spring.strut]
stiffness_N_per_m = 1.055720845676547
natural_length_m = 1.3071425052392294
damping_N_s_per_m = 1.5576876251694538
[force.push]
x_N = 1.14521363067059
[friction.guide]
coordinate = "rod.x"
normal_force_N = 0.7430653753393642
static_coefficient = 0.2
dynamic_coefficient = 0.15
transition_velocity_m_per_s = 0.03946862214862261
[run]
t_end_s = 8.88378437261914
)");
  const std::vector<std::string> how = {"--parameters", "l0", "--formulation", "index1", "--method", "cvodes-forward"};
  const auto with = [&](const char* option, const char* value) {
    auto options = how;
    options.insert(options.end(), {option, value});
    return gradient_of("sticky.toml", options, here);
  };
  const Json right = with("--rtol", "1e-11"), own = with("--accuracy", "1e-2");
  CHECK(own["accuracy"]["met"] == true);
  CHECK(own["accuracy"]["runs"].get<int>() > 2);
  CHECK(error_of(own, right) <= 1e-2);
}

TEST_CASE("accuracy: runs that end by an event, and samples, are chosen for over their whole time", "[accuracy]") {
  // Over the first quarter of t_end_s neither the end nor the last sample would come. x = t^2/2 meets 0.9 m at
  // t = sqrt(1.8) s; psi = t there, and dpsi/dm = t/2 for m = 1 kg.
  const WorkingDirectory here;
  const std::string scene = R"([point.P]
x_m = 0
y_m = 0
[mass.m]
point = "P"
mass_kg = 1
[force.f]
point = "P"
x_N = 1
[start]
given = ["P.x", "P.y"]
)";
  write_text(here.path() / "end.toml", scene + R"([[cost.terminal]]
kind = "value"
output = "time"
[run]
t_end_s = 4
ends_when = { output = "P.x", above = 0.9 }
parameters = ["mass.m.mass_kg"]
)");
  const Json end = gradient_of("end.toml", {"--accuracy", "1e-6"}, here);
  CHECK(end["accuracy"]["met"] == true);
  CHECK(end["psi"].get<double>() == Approx(std::sqrt(1.8)).epsilon(1e-6));
  CHECK(end["gradient"]["mass.m.mass_kg"].get<double>() == Approx(std::sqrt(1.8) / 2).epsilon(1e-6));
  // (1/2 - 0.4)^2 + (2 - 2.2)^2 at 1 and 2 s, with dx/dm = -x.
  write_text(here.path() / "samples.toml", scene + R"([data.d]
columns = ["t", "x"]
rows = [[1, 0.4], [2, 2.2]]
[[cost.samples]]
data = "d"
column = "x"
output = "P.x"
sigma = 1
[run]
t_end_s = 2
parameters = ["mass.m.mass_kg"]
)");
  const Json samples = gradient_of("samples.toml", {"--accuracy", "1e-6"}, here);
  CHECK(samples["psi"].get<double>() == Approx(0.05).epsilon(1e-6));
  CHECK(samples["gradient"]["mass.m.mass_kg"].get<double>() == Approx(2 * (0.1 * -0.5 - 0.2 * -2)).epsilon(1e-6));
}

TEST_CASE("accuracy: what cannot be met or held to it is said", "[accuracy]") {
  const WorkingDirectory here;
  const auto refused = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"gradient", kFiveBar, "--no-files", "--accuracy"});
    const auto outcome = run_costate(options, here.path());
    CHECK(outcome.status != 0);
    CHECK(outcome.out.empty());
    return outcome.err;
  };
  CHECK_THAT(refused({"2"}), Contains("between 0 and 1"));
  CHECK_THAT(refused({"nan"}), Contains("--accuracy"));
  CHECK_THAT(refused({"1e-4", "--rtol", "1e-8"}), Contains("--rtol") && Contains("exclude"));
  CHECK_THAT(refused({"1e-4", "--formulation", "penalty"}), Contains("soft constraints"));
  CHECK_THAT(refused({"1e-4", "--method", "hand-adjoint"}), Contains("cannot be held to an accuracy"));
  // Chaos: the error doubles many times a second, so that no tolerance holds eight digits over 100 s.
  write_text(here.path() / "chaos.toml", kDoublePendulum);
  const auto outcome =
      run_costate({"simulate", "chaos.toml", "--no-files", "--accuracy", "1e-8", "--json"}, here.path());
  CHECK(outcome.status == 1);
  const Json run = one_object(outcome.out);
  CHECK(run["accuracy"]["met"] == false);
  CHECK_THAT(run["warnings"].dump(), Contains("was not reached"));
  CHECK(run["psi_error"].get<double>() > 1e-8 * std::abs(run["psi"].get<double>()));
}

TEST_CASE("accuracy: a psi that is small against absolute tolerances is met, or said to be nothing") {
  const WorkingDirectory here;
  const std::string cases = COSTATE_SOURCE_DIR "/test/cases/", peak = cases + "peak_on_the_way.toml";
  const Json met = costate_json({"simulate", peak, "--no-files", "--accuracy", "1e-4"}, here.path());
  CHECK(met["accuracy"]["met"] == true);
  CHECK(std::abs(met["psi"].get<double>() - 5e-6) <= 1e-4 * 5e-6);
  for (const char* rtol : {"1e-6", "1e-8", "1e-10"}) {
    INFO(rtol);
    const Json plain = costate_json({"simulate", peak, "--no-files", "--rtol", rtol}, here.path());
    CHECK(std::abs(plain["psi"].get<double>() - 5e-6) <= 3 * plain["psi_error"].get<double>());
  }
  const auto small =
      run_costate({"simulate", cases + "small_about_a_metre.toml", "--no-files", "--accuracy", "1e-4"}, here.path());
  CHECK_THAT(small.err, Contains("counts as nothing"));
}

TEST_CASE("accuracy: where the derivative of a scheme's steps hardly gets better others have their turn") {
  const WorkingDirectory here;
  // A road of random elevations bends within most steps of dop853: its gradient falls with the root of the tolerance.
  const std::string scene = kModels + "iltis/four_post_white.toml";
  const std::vector<std::string> part = {"--parameters", "c1,c2", "--t-end", "1"};
  const auto with = [&](std::vector<std::string> options) {
    options.insert(options.end(), part.begin(), part.end());
    return gradient_of(scene, options, here);
  };
  const Json run = with({"--accuracy", "1e-7"});
  CHECK(run["accuracy"]["met"] == true);
  CHECK(run["integrator"] != "dop853");
  CHECK(run["integrator"] != "dopri5");
  const Json right = with({"--formulation", "index1", "--method", "cvodes-forward", "--rtol", "1e-12"});
  CHECK(error_of(run, right) <= 1e-7);
}

// Two loose runs of a high order agreed by chance: of 280 oscillators at 5e-3 twenty gradients missed the request, by
// up to nine times, and of growing motions every request from 5e-4 on. None of 2,900 does where the first run of a
// scheme is at 2e-5 at most.
TEST_CASE("accuracy: loose requests of long oscillations and of motions that grow are met", "[accuracy]") {
  const WorkingDirectory here;
  const auto run = [&](double k, double c, double end, const std::string& cost, const std::string& accuracy) {
    write_text(here / "s.toml",
               fmt::format("[point.P]\nx_m = 1\ny_m = 0\n[mass.m]\npoint = \"P\"\nmass_kg = 1\n[force.F]\npoint = "
                           "\"P\"\nformula_x_N = \"-k*P.x-c*P.x_dot\"\nk = {}\nc = {}\n[start]\ngiven = [\"P.x\", "
                           "\"P.y\"]\n{}output = \"P.x\"\n[parameter.k]\nnumber = \"force.F.k\"\n[run]\nt_end_s = "
                           "{}\nparameters = [\"k\"]\n",
                           k, c, cost, end));
    return costate_json({"gradient", "s.toml", "--no-files", "--accuracy", accuracy}, here.path());
  };
  const double k = 292.4069133813701, c = 0.0910543856372596, T = 11.76525962449493;
  for (const char* accuracy : {"1e-2", "5e-3", "3e-3", "1e-3"}) {
    CAPTURE(accuracy);
    const double a = std::stod(accuracy);
    // In closed form; the derivative by k of x^2's integral is small, so that psi's request is the stricter one.
    const Json vibrates = run(k, c, T, "[[cost.running]]\nkind = \"square\"\n", accuracy);
    CHECK(vibrates.at("psi").get<double>() == Approx(3.61140949).epsilon(a));
    const Json grows = run(-9, 0, 14, "[[cost.terminal]]\nkind = \"value\"\n", accuracy);
    CHECK(grows.at("psi").get<double>() == Approx(std::cosh(42.0)).epsilon(a));
    CHECK(grows.at("gradient").at("k").get<double>() == Approx(-14 * std::sinh(42.0) / 6).epsilon(a));
  }
}

// At resonance looks at the force's law bound the steps: at 1e-3, 1.5e-4 and 2e-5 dop853 takes the same 594 to 600, so
// that two runs differ by nothing and are 1.1e-3 off. psi was stated to 1e-5 where it was 1.4e-4 off.
TEST_CASE("accuracy: runs that take the same steps tell no error", "[accuracy]") {
  const WorkingDirectory here;
  write_text(here / "s.toml", R"toml([point.P]
x_m = 0
y_m = 0
[mass.m]
point = "P"
mass_kg = 1
[force.f]
point = "P"
formula_x_N = "F*sin(5*t)-25*P.x"
F = 1
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "value"
output = "P.x"
[[cost.running]]
kind = "value"
output = "P.x"
[run]
t_end_s = 40
parameters = ["force.f.F"]
)toml");
  // x = (sin 5 t - 5 t cos 5 t)/50, and its integral (2 - 2 cos 5 t - 5 t sin 5 t)/250; psi is linear in F.
  const double w = 5, t = 40,
               psi = (std::sin(w * t) - w * t * std::cos(w * t)) / (2 * w * w) +
                     (2 - 2 * std::cos(w * t) - w * t * std::sin(w * t)) / (2 * w * w * w);
  for (const char* accuracy : {"1e-3", "1e-4"}) {
    CAPTURE(accuracy);
    for (const char* command : {"simulate", "gradient"}) {
      const Json j = costate_json({command, "s.toml", "--no-files", "--accuracy", accuracy}, here.path());
      CHECK(std::abs(j.at("psi").get<double>() / psi - 1) <= std::stod(accuracy));
      CHECK(std::abs(j.at("psi").get<double>() - psi) <= 4 * j.at("psi_error").get<double>());
    }
  }
}

// The pin's body stays at the origin but for rounding, against whose range errors of it were measured: 5e-1 was said to
// be what is reached, and status 1.
TEST_CASE("accuracy: a coordinate that is nothing but rounding decides nothing") {
  const WorkingDirectory here;
  write_text(here / "pin.toml", R"([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[body.b]
mass_kg = 2
inertia_kg_m2 = 0.1
center_x_m = 0.5
x_m = 0
y_m = 0
angle_rad = 0.5
[point.A]
on = "b"
x_m = 0
y_m = 0
[revolute.p]
points = ["O", "A"]
[start]
given = ["b.angle"]
[[cost.terminal]]
kind = "value"
output = "b.angle"
[run]
t_end_s = 1
)");
  const Json j = costate_json({"simulate", "pin.toml", "--accuracy", "1e-6", "--no-files"}, here.path());
  CHECK(j["accuracy"]["met"] == true);
  // By scipy's DOP853 at 1e-13.
  CHECK(std::abs(j["psi"].get<double>() + 3.61762930) <= 3.7e-6);
}
