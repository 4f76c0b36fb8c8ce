// Running costs that are narrow pulses, and far below what absolute tolerances are made for.
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

// A pulse exp(-((t - t0)/w)^2) in the cost, of area A w sqrt(pi) far below what atol makes of psi: steps met it, and no
// error test looked at it, so that every run was off by the same 3 to 26 percent, and said 1e-3 of that.
TEST_CASE("psi of a narrow pulse far below absolute tolerances", "[confirmation]") {
  struct Pulse {
    double A, w, rtol;
  };
  for (const Pulse& pulse : {Pulse{1e-8, 1e-3, 1e-8}, {1, 1e-7, 1e-5}, {1e-4, 2e-5, 1e-5}, {1e-6, 1e-3, 1e-7}})
    for (const char* method : {"idas-adjoint", "idas-forward", "cvodes-adjoint", "hand-adjoint"}) {
      const Problem p = make_problem(Scene::parse(fmt::format(R"toml(
[point.P]
x_m = 0
y_m = 0
vx_m_per_s = 1
[mass.m]
point = "P"
mass_kg = 1
[force.f]
point = "P"
formula_x_N = "-P.x"
formula_y_N = "-P.y"
[output.s]
formula = "A*exp(-((t-1.2345)/w)^2)"
unit = "1"
A = {}
w = {}
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 5
rtol = {}
parameters = ["A"]
[parameter.A]
number = "output.s.A"
[[cost.running]]
kind = "value"
output = "s"
)toml",
                                                              pulse.A, pulse.w, pulse.rtol),
                                                  "pulse.toml"));
      CAPTURE(pulse.A, pulse.w, pulse.rtol, method);
      const double area = pulse.w * std::sqrt(std::acos(-1.0)), right = pulse.A * area,
                   within = std::min(0.1, 1e4 * pulse.rtol);
      const GradientResult r = gradient(p, method, p.parameters.values());
      take_notices();
      CHECK(std::abs(r.psi - right) <= within * right);
      CHECK(std::abs(r.gradient[0] - area) <= within * area);
    }
}
