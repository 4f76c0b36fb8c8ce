// Forces and torques that are formulas: against numbers of an independent program, and their mistakes.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Contains;

namespace {

Scene wheel(const std::string& couple, const std::string& more = "") {
  return Scene::parse(R"toml([body.wheel]
x_m = 0
y_m = 0
angle_rad = 0.3
mass_kg = 2
inertia_kg_m2 = 0.05
[couple.gas]
angle = "wheel"
)toml" + couple + R"toml(
[start]
given = ["wheel.x", "wheel.y", "wheel.angle"]
[[cost.running]]
kind = "square"
output = "gas.power"
[run]
t_end_s = 2
rtol = 1e-10
parameters = ["couple.gas.p", "couple.gas.d", "body.wheel.inertia_kg_m2"]
)toml" + more,
                      "wheel.toml");
}

const std::string kGas = R"(formula = "p*(1.2 + cos(wheel.angle))^(-1.4)*sin(wheel.angle) - d*wheel.angle_dot"
p = 3
d = 0.02)";

}  // namespace

// scipy 1.10, solve_ivp by DOP853 at rtol 1e-12 of I w' = T(a, w), psi' = (T w)^2; derivatives by differences of fourth
// order (step 1e-4 of each number), good to some 1e-7.
TEST_CASE("formula forces: gas pressure over a crank's angle, as an independent program has it") {
  const double psi = 3271.2546972059968;
  const std::vector<double> right = {2915.883941422079, -22470.126710004475, -35114.79848101923};
  for (const char* formulation : {"index1", "baumgarte", "maggi", "index3"})
    for (const SensitivityMethod& method : sensitivity_methods()) {
      Problem p = make_problem(wheel(kGas));
      p.formulation = formulation;
      if (!refusal(method, find_formulation(formulation)).empty() || by_fixed_steps(p, method) || method.perturbs)
        continue;
      INFO(formulation << " x " << method.name);
      const GradientResult r = gradient(p, method.name, p.parameters.values());
      // Errors of a tolerance a step, some thousand steps of a motion whose energy grows a hundredfold; of derivatives
      // against the largest scaled one, that by p.
      CHECK(r.psi == Approx(psi).epsilon(2e-7));
      for (std::size_t j = 0; j < right.size(); ++j)
        CHECK(std::abs(r.gradient[j] - right[j]) * p.parameters.parameters[j].scale <= 1e-6 * 3 * right[0]);
    }
}

namespace {
std::string servo(const std::string& command) {
  return R"toml([body.wheel]
x_m = 0
y_m = 0
angle_rad = 0.3
mass_kg = 2
inertia_kg_m2 = 0.05
[actuator.M]
angle = "wheel"
time_constant_s = 0.05
initial_torque_N_m = 0.1
work = true
)toml" + command +
         R"toml(
[start]
given = ["wheel.x", "wheel.y", "wheel.angle"]
[[cost.running]]
kind = "square"
output = "M.torque"
[[cost.terminal]]
kind = "value"
output = "M.work"
[run]
t_end_s = 2
rtol = 1e-10
)toml";
}
}  // namespace

// scipy 1.10, solve_ivp by DOP853 at rtol 1e-13 of I w' = T, T' = (k (sin 2t - a) - d w - T)/tau, W' = T w, psi' = T^2;
// derivatives by differences of fourth order, which agree with those of twice the step to 1e-9.
TEST_CASE("formula forces: an actuator's controller, as an independent program has it") {
  const double psi = 0.20780640046283744;
  const std::vector<double> right = {0.09148298959172144, -0.5814700351781249, 1.1404431516648383, 6.528695530937864,
                                     -0.048575162093500435};
  for (const char* formulation : {"index1", "baumgarte", "maggi", "index3"})
    for (const SensitivityMethod& method : sensitivity_methods()) {
      Problem p = make_problem(
          Scene::parse(servo("formula = \"k*(sin(2*t) - wheel.angle) - d*wheel.angle_dot\"\nk = 2\nd = 0.3\n") +
                           "parameters = [\"actuator.M.k\", \"actuator.M.d\", \"actuator.M.time_constant_s\", "
                           "\"body.wheel.inertia_kg_m2\", \"actuator.M.initial_torque_N_m\"]\n",
                       "servo.toml"));
      p.formulation = formulation;
      if (!refusal(method, find_formulation(formulation)).empty() || by_fixed_steps(p, method) || method.perturbs)
        continue;
      INFO(formulation << " x " << method.name);
      const GradientResult r = gradient(p, method.name, p.parameters.values());
      // A tolerance a step over some thousand steps; of derivatives against the largest, that by the inertia.
      CHECK(r.psi == Approx(psi).epsilon(1e3 * 1e-10 * 10));
      for (std::size_t j = 0; j < right.size(); ++j)
        CHECK(std::abs(r.gradient[j] - right[j]) <= 1e3 * 1e-10 * 10 * right[3]);
    }
}

// A formula of the time alone is a law of time: the same command, force, sign and motion, along lines and about angles.
TEST_CASE("formula forces: an actuator's formula of the time is its law of time") {
  const std::string line = R"toml([point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0.5
[mass.P]
point = "P"
mass_kg = 1.5
[actuator.M]
from = "A"
to = "P"
time_constant_s = 0.1
initial_force_N = 2
)toml",
                    rest = R"toml([start]
given = ["P.x", "P.y"]
[[cost.running]]
kind = "value"
output = "M.power"
[[cost.terminal]]
kind = "square"
output = "M.length"
[run]
t_end_s = 1
rtol = 1e-10
parameters = ["actuator.M.time_constant_s", "actuator.M.initial_force_N", "mass.P.mass_kg"]
)toml";
  const std::string law = "kind = \"sine\", mean = 1, amplitude = 4, angular_frequency_rad_per_s = 6";
  const std::string formula = "formula = \"1 + 4*sin(6*t)\"\n";
  const auto same = [](const std::string& a, const std::string& b) {
    GradientResult r[2];
    for (int i = 0; i < 2; ++i) {
      Problem p = make_problem(Scene::parse(i == 0 ? a : b, "same.toml"));
      r[i] = gradient(p, "cvodes-adjoint", p.parameters.values());
    }
    // Both are good to the tolerances of some thousand steps.
    CHECK(r[0].psi == Approx(r[1].psi).epsilon(1e-7));
    REQUIRE(r[0].gradient.size() > 2);
    for (std::size_t j = 0; j < r[0].gradient.size(); ++j)
      CHECK(r[0].gradient[j] == Approx(r[1].gradient[j]).epsilon(1e-6));
  };
  same(line + formula + rest, line + "command_N = { " + law + " }\n" + rest);
  const std::string parameters =
      "parameters = [\"actuator.M.time_constant_s\", \"actuator.M.initial_torque_N_m\", "
      "\"body.wheel.inertia_kg_m2\"]\n";
  same(servo(formula) + parameters, servo("command_N_m = { " + law + " }\n") + parameters);
}

TEST_CASE("formula forces: mistakes of an actuator's formula have their place") {
  const auto with = [](const std::string& command) { return [=] { Scene::parse(servo(command), "servo.toml"); }; };
  CHECK_THROWS_WITH(with("formula = \"k*whel.angle\"\nk = 1")(),
                    Contains("servo.toml:12") && Contains("'whel.angle' is no position or velocity"));
  CHECK_THROWS_WITH(with("formula = \"1\"\ncommand_N_m = 2")(),
                    Contains("servo.toml:13") && Contains("'command_N_m' is in no formula"));
  CHECK_THROWS_WITH(with("formula = \"M.torque\"")(), Contains("servo.toml:12"));
  CHECK_THROWS_WITH(with("formula = \"sinus(t)\"")(), Contains("servo.toml:12") && Contains("sinus"));
}

TEST_CASE("formula forces: mistakes have their place") {
  const auto with = [](const std::string& couple) { return [=] { wheel(couple); }; };
  CHECK_THROWS_WITH(with("formula = \"p*whel.angle\"\np = 1\nd = 1")(),
                    Contains("wheel.toml:9") && Contains("'whel.angle' is no position or velocity"));
  CHECK_THROWS_WITH(with("formula = \"p*wheel.angle\"\np = 1\nd = 1")(),
                    Contains("wheel.toml:11") && Contains("'d' is in no formula"));
  CHECK_THROWS_WITH(with("formula = \"p*wheel.angle +\"\np = 1")(), Contains("wheel.toml:9"));
  CHECK_THROWS_WITH(with("formula = \"p*sinus(t)\"\np = 1")(), Contains("wheel.toml:9") && Contains("sinus"));
  CHECK_THROWS_WITH(with("formula = \"p\"\np = \"x\"")(), Contains("wheel.toml:10"));
  CHECK_THROWS_WITH(with("formula = \"p\"\np = 1\ntorque_N_m = 1")(), Contains("wheel.toml:11"));
  CHECK_THROWS_WITH(with("formula = \"gas.power*p\"\np = 1\nd = 1")(), Contains("wheel.toml:9"));
}
