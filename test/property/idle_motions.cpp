// Motions that tell an integrator nothing of what derivatives need: at rest or uniform, whose steps have no error
// however long they are; and below absolute tolerances, which damp them away.
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/motion_confirmation.h"

using namespace costate;

namespace {

/// In uniform motion, and a force that k would make: y'' = k sin(5 x) - c y' with x = t, k = 0.
const char* const uniform = R"toml(
[point.P]
x_m = 0
y_m = 0
vx_m_per_s = 1
[mass.p]
point = "P"
mass_kg = 1
[force.f]
point = "P"
formula_y_N = "k*sin(5*P.x) - c*P.y_dot"
k = 0
c = 0.5
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "value"
output = "P.y"
[parameter.k]
number = "force.f.k"
scale = 1.0
[run]
t_end_s = 6
parameters = ["k"]
)toml";

/// A pendulum that hangs, of which torques and a velocity would make something.
const char* const at_rest = R"toml(
[gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0
y_m = -1
[bar.rod]
from = "A"
to = "P"
mass_kg = 2
[angle.th]
bar = "rod"
angular_velocity_rad_per_s = 0
[couple.c]
angle = "th.angle"
formula = "a*sin(w*t)"
a = 0
w = 4
[start]
given = ["th.angle"]
[[cost.terminal]]
kind = "value"
output = "P.x"
[parameter.a]
number = "couple.c.a"
scale = 1.0
[parameter.w0]
number = "angle.th.angular_velocity_rad_per_s"
scale = 1.0
[run]
t_end_s = 5
parameters = ["a", "w0"]
)toml";

/// Two bars that hang, off by 0.2 and 0.5 mm: below the absolute tolerances at rtol 1e-3.
const char* const tiny = R"toml(
[gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.0002
y_m = -1.0
[bar.rod]
from = "A"
to = "P"
mass_kg = 2
length_m = 1
[point.Q]
x_m = 0.0005
y_m = -1.7
[bar.r2]
from = "P"
to = "Q"
mass_kg = 1
length_m = 0.7
[start]
given = ["P.x", "Q.x"]
[[cost.terminal]]
kind = "square"
output = "Q.x"
[parameter.x0]
number = "point.P.x_m"
[run]
t_end_s = 4
parameters = ["x0"]
)toml";

Problem problem_of(const char* text, const std::string& formulation, double rtol) {
  Problem p = make_problem(Scene::parse(text, "idle.toml"));
  p.formulation = formulation;
  p.solver.set_rtol(rtol);
  return p;
}

/// Each derivative within three times what is stated, and that within 300 tolerances of the first.
void check(const Problem& p, const std::string& method, const std::vector<double>& exact) {
  const GradientResult r = gradient(p, method, p.parameters.values());
  CHECK(take_notices().empty());
  for (std::size_t j = 0; j < exact.size(); ++j) {
    const double known = r.known_error ? r.known_error->gradient[j] : 0;
    CAPTURE(j, r.gradient[j], exact[j], known);
    CHECK(std::abs(r.gradient[j] - exact[j]) <= 3 * known + 1e-12);
    CHECK(known <= 300 * p.solver.rtol * std::abs(exact[0]));
  }
}

}  // namespace

// Steps of any length are exact to these motions, and derivatives of steps as long as a tenth of the run had been those
// of nothing (-9.87 for 0.419), alike at all tolerances. Closed forms: y_k by variation of constants; of the pendulum
// x'' = -w0^2 x + a sin(4 t)/(m l^2/3), with w0^2 = 1.5 g/l.
TEST_CASE("idle motions: derivatives of Runge-Kutta steps", "[discrete]") {
  const double c = 0.5, T = 6, n = c * c + 25;
  const double of_k = (-c * std::cos(5 * T) / 5 - std::sin(5 * T) - 5 * std::exp(-c * T) / c + c / 5 + 5 / c) / n;
  const double o = std::sqrt(1.5 * 9.81), t = 5, J = 2.0 / 3;
  const std::vector<double> of_pendulum = {(std::sin(4 * t) - 4 / o * std::sin(o * t)) / (o * o - 16) / J,
                                           std::sin(o * t) / o};
  for (const char* integrator : {"dopri5", "dop853", "radau3", "radau5", "radau9"})
    for (const double rtol : {1e-3, 1e-5, 1e-8}) {
      for (const char* method : {"discrete-adjoint", "discrete-tangent"}) {
        CAPTURE(integrator, rtol, method);
        Problem moves = problem_of(uniform, "baumgarte", rtol);
        moves.solver.integrator = integrator;
        check(moves, method, {of_k});
        for (const char* formulation : {"baumgarte", "index1"}) {
          CAPTURE(formulation);
          Problem rests = problem_of(at_rest, formulation, rtol);
          rests.solver.integrator = integrator;
          check(rests, method, of_pendulum);
        }
      }
    }
}

// A motion that is damped away has no digit, and says so: psi and its derivative, 1.11870e-7 and 1.0627e-3 by index1 on
// CVODES at 1e-11, are within three times what is stated.
TEST_CASE("idle motions: those below absolute tolerances", "[confirmation]") {
  Problem fine = problem_of(tiny, "index1", 1e-11);
  const GradientResult right = gradient(fine, "cvodes-forward", fine.parameters.values());
  take_notices();
  for (const char* formulation : {"index2", "index3", "baumgarte"})
    for (const char* method : {"hand-adjoint", "hand-tangent", "idas-forward", "idas-adjoint"})
      for (const double rtol : {1e-3, 3e-4, 1e-4}) {
        CAPTURE(formulation, method, rtol);
        const Problem p = problem_of(tiny, formulation, rtol);
        const GradientResult r = gradient(p, method, p.parameters.values());
        take_notices();
        REQUIRE(r.known_error);
        CAPTURE(r.psi, r.known_error->psi, r.gradient[0], r.known_error->gradient[0]);
        CHECK(std::abs(r.psi - right.psi) <= 3 * r.known_error->psi);
        CHECK(std::abs(r.gradient[0] - right.gradient[0]) <= 3 * r.known_error->gradient[0]);
      }
}

// The same of a simulation, which states psi's error alone.
TEST_CASE("idle motions: a simulation of one below absolute tolerances", "[confirmation]") {
  const Problem fine = problem_of(tiny, "index1", 1e-11);
  const double right = simulate(fine, fine.parameters.values()).psi;
  for (const char* formulation : {"index2", "baumgarte"})
    for (const double rtol : {1e-3, 1e-4}) {
      CAPTURE(formulation, rtol);
      const Problem p = problem_of(tiny, formulation, rtol);
      const Simulation r = confirmed_simulation(p, p.parameters.values(), {}, {});
      take_notices();
      REQUIRE(r.known_error);
      CHECK(std::abs(r.psi - right) <= 3 * r.known_error->psi);
    }
}
