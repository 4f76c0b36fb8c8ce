// Laws of time that are straight between data: schemes of high order end a step at each bend, those between pieces of
// one length, too.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

const char* const kPulse = R"toml([point.P]
x_m = 0.3
y_m = 0
[mass.m]
point = "P"
mass_kg = 2
[force.pulse]
point = "P"
y_N = { kind = "data", x = [0, 0.5, 0.5001, 0.5002, 1.5, 3], y = [0, 0, 2000, 0, 0, 3], between = "lines" }
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "value"
output = "P.y"
[parameter.m]
number = "mass.m.mass_kg"
[run]
t_end_s = 3
parameters = ["m"]
)toml";

}  // namespace

// An impulse of 0.2 N s about t = 0.5001 s, and a force that grows by 2 N/s from 1.5 s on:
//   m y(3) = 0.2 (3 - 0.5001) + 2 * 1.5^3/6.
TEST_CASE("pulses of lines: schemes of high order") {
  const double m = 2, my = 0.2 * (3 - 0.5001) + 2 * 1.5 * 1.5 * 1.5 / 6;
  Problem p = make_problem(Scene::parse(kPulse, "pulse.toml"));
  p.formulation = "index1";
  for (const char* integrator : {"radau5", "radau9", "dopri5", "dop853"})
    for (const double rtol : {1e-5, 1e-8, 1e-10, 3e-10}) {
      CAPTURE(integrator, rtol);
      p.solver.integrator = integrator;
      p.solver.set_rtol(rtol);
      // Cubics are within these schemes' orders: what is left is rounding, and Newton's stop of implicit ones.
      CHECK(std::abs(simulate(p, p.parameters.values()).psi - my / m) <= 1e-9);
      const GradientResult r = gradient(p, "discrete-adjoint", p.parameters.values());
      CHECK(std::abs(r.gradient[0] + my / (m * m)) <= 1e-9);
    }
}
