// Wheels about a pin, whose steps are as long as any: laws by formulas of an angle, whose own terms say nothing of
// where they act; and running costs of what a motion does to accelerations and reactions.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Detail::Approx;

namespace {

Problem wheel_problem(double speed, double t_end, const std::string& rest, double rtol = 1e-8) {
  const std::string text = fmt::format(R"toml([point.O]
ground = true
x_m = 0
y_m = 0
[body.wheel]
x_m = 0
y_m = 0
center_x_m = 0.1
mass_kg = 1
inertia_kg_m2 = 2
angle_rad = 0.3
angular_velocity_rad_per_s = {}
[point.pin]
on = "wheel"
x_m = 0
y_m = 0
[revolute.a]
points = ["O", "pin"]
[point.Q]
on = "wheel"
x_m = 1
y_m = 0
[start]
given = ["wheel.angle"]
[run]
t_end_s = {}
rtol = {}
)toml",
                                       speed, t_end, rtol);
  std::string whole = text;
  if (rest.find("[parameter.c]") != std::string::npos) whole += "parameters = [\"c\"]\n";
  whole += rest;
  return make_problem(Scene::parse(whole, "wheel.toml"));
}

double psi_of(Problem p, const char* formulation, const char* integrator) {
  p.formulation = formulation;
  p.solver.integrator = integrator;
  return simulate(p, p.parameters.values()).psi;
}

struct By {
  const char *formulation, *integrator;
};
constexpr By kBy[] = {{"baumgarte", "idas"}, {"maggi", "cvodes"},  {"index2", "radau5"},
                      {"maggi", "dop853"},   {"index1", "dopri5"}, {"penalty", "radau9"}};

constexpr const char* kLastAngle = "[[cost.terminal]]\nkind = \"value\"\noutput = \"wheel.angle\"\n";

}  // namespace

TEST_CASE("brief wheels: a law by a formula of what turns acts wherever its terms pass") {
  // 1 to 3 ms a passage, of 3 s at 7 rad/s. The angle at the end by scipy's DOP853 at 1e-12 with steps of 1e-4 s at
  // most; the inertia about the pin is 2.01 here, so that the torque is as much larger. 21.24 to 21.28 where such laws
  // were looked at along x alone. Within 1e4 rtol: the formulas multiply an error of the angle by 1/w.
  const char* const spring =
      "[torsion_spring.s]\nangle = \"wheel\"\nspring_law = {{ kind = \"formula\", formula = "
      "\"K*exp(-((sin(x)-c)/w)^2)\", K = 20.1, c = 0.5, w = {} }}\n{}";
  const char* const nested =
      "[couple.k]\nangle = \"wheel\"\nformula = \"K*b(wheel.angle)\"\nK = 20.1\nb = {{ kind = "
      "\"formula\", formula = \"exp(-((sin(x)-c)/w)^2)\", c = 0.5, w = {} }}\n{}";
  for (const By& by : kBy) {
    INFO(by.formulation << " on " << by.integrator);
    const auto angle = [&](const std::string& rest) {
      return psi_of(wheel_problem(7, 3, rest), by.formulation, by.integrator);
    };
    CHECK(angle(fmt::format(fmt::runtime(spring), 0.003, kLastAngle)) == Approx(21.196455485).margin(1e-4));
    CHECK(angle(fmt::format(fmt::runtime(spring), 0.01, kLastAngle)) == Approx(20.954579022).margin(1e-4));
    CHECK(angle(fmt::format(fmt::runtime(nested), 0.003, kLastAngle)) == Approx(21.403465430).margin(1e-4));
  }
}

TEST_CASE("brief wheels: what is left of tanh where it has reached one is rounding") {
  // A window of a force along a spring: runs did not end, as the law's last digits changed from look to look. By
  // scipy's DOP853 at 1e-12.
  const std::string text = R"toml([point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0
vx_m_per_s = 1
[mass.m]
point = "P"
mass_kg = 1
[spring.s]
from = "A"
to = "P"
natural_length_m = 0
stiffness_N_per_m = 0
spring_law = { kind = "formula", formula = "K*(tanh((x-a)/w)-tanh((x-b)/w))", K = 0.1, a = 2, b = 2.2, w = 0.01 }
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "value"
output = "P.x"
[run]
t_end_s = 3
rtol = 1e-8
)toml";
  for (const By& by : kBy) {
    INFO(by.formulation << " on " << by.integrator);
    Problem p = make_problem(Scene::parse(text, "window.toml"));
    p.formulation = by.formulation;
    p.solver.integrator = by.integrator;
    const Simulation r = simulate(p, p.parameters.values());
    CHECK(r.psi == Approx(3.92250209847).margin(2e-6));
    CHECK(r.counters.steps < 3000);
  }
}

TEST_CASE("brief wheels: running costs see what accelerations and reactions do within a step") {
  // reaction_x = m r w^2 cos(0.3 + w t) with m r w^2 = 160 N at 40 rad/s. psi was 0.45 by SUNDIALS, 94 by dop853, and
  // --accuracy content.
  const double w = 40, size = 160, c = 100;
  const int n = 4'000'000;
  double psi = 0, dc = 0;
  for (int i = 0; i < n; ++i) {
    const double over = size * std::cos(0.3 + w * 10 * (i + 0.5) / n) - c;
    psi += std::max(0.0, over) * 10 / n;
    dc -= (over > 0 ? 10.0 : 0.0) / n;
  }
  const std::string above =
      "[output.g]\nformula = \"max(0, a.reaction_x - c)\"\nunit = \"N\"\nc = 100\n"
      "[[cost.running]]\nkind = \"value\"\noutput = \"g\"\n[parameter.c]\nnumber = "
      "\"output.g.c\"\n";
  for (const By& by : kBy) {
    INFO(by.formulation << " on " << by.integrator);
    CHECK(psi_of(wheel_problem(w, 10, above), by.formulation, by.integrator) == Approx(psi).epsilon(1e-5));
  }
  for (const char* method : {"idas-adjoint", "cvodes-adjoint", "idas-forward", "discrete-adjoint"}) {
    INFO(method);
    Problem p = wheel_problem(w, 10, above);
    p.formulation = "baumgarte";
    const GradientResult r = gradient(p, method, p.parameters.values());
    take_notices();  // of how much the motion makes of small errors
    CHECK(r.psi == Approx(psi).epsilon(1e-5));
    CHECK(r.gradient[0] == Approx(dc).epsilon(1e-4));
  }
  // Where segments are repeated from checkpoints IDAS does not control psi's quadrature: 7554 for 21.65 over 2 s.
  for (const char* method : {"idas-adjoint", "cvodes-adjoint"}) {
    INFO(method);
    Problem p = wheel_problem(w, 2, above);
    p.formulation = "baumgarte";
    const GradientResult whole = gradient(p, method, p.parameters.values());
    p.solver.checkpoint_steps = 20;
    const GradientResult parts = gradient(p, method, p.parameters.values());
    take_notices();
    CHECK(parts.psi == Approx(whole.psi).epsilon(1e-5));
    CHECK(parts.gradient[0] == Approx(whole.gradient[0]).epsilon(1e-3));
  }
  // A bell of 3 m/s^2 about -30 in Q's acceleration of 49 at 7 rad/s, four passages of 10 ms a turn.
  const std::string bell =
      "[output.g]\nformula = \"exp(-((Q.x_ddot+30)/3)^2)\"\nunit = \"1\"\n"
      "[[cost.running]]\nkind = \"value\"\noutput = \"g\"\n";
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const double x = (-49 * std::cos(0.3 + 7 * 10 * (i + 0.5) / n) + 30) / 3;
    sum += std::exp(-x * x) * 10 / n;
  }
  for (const By& by : kBy) {
    INFO(by.formulation << " on " << by.integrator);
    CHECK(psi_of(wheel_problem(7, 10, bell), by.formulation, by.integrator) == Approx(sum).epsilon(1e-5));
  }
}

TEST_CASE("brief wheels: Maggi's formulation follows a wheel that rolls many turns in a step") {
  const std::string text = R"toml([body.w]
x_m = 0
y_m = 0.5
mass_kg = 1
inertia_kg_m2 = 0.2
angle_rad = 0.3
angular_velocity_rad_per_s = -17
vx_m_per_s = 8.5
[driver.y]
coordinate = "w.y"
law = 0.5
[rack_and_pinion.r]
angle = "w.angle"
coordinate = "w.x"
radius_m = -0.5
[start]
given = ["w.angle"]
[[cost.terminal]]
kind = "value"
output = "w.angle"
[run]
t_end_s = 40
rtol = 1e-6
)toml";
  const Problem p = make_problem(Scene::parse(text, "rolling.toml"));
  for (const char* integrator : {"cvodes", "dopri5", "dop853"}) {
    INFO(integrator);
    CHECK(psi_of(p, "maggi", integrator) == Approx(0.3 - 17 * 40).epsilon(1e-9));
  }
  CHECK(psi_of(p, "maggi-implicit", "idas") == Approx(0.3 - 17 * 40).epsilon(1e-9));
}
