// What rests at the origin of the coordinates and is lifted off: forces balance there, and all positions are zero.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

// A mass on the ground is pulled up by c t, and leaves it at t0 = g/c: y = c (t - t0)^3/6 from there on. Accelerations
// on both sides are what rounding leaves of c t0 - g, and were found to jump by all of themselves; and the gap, at no
// place to take parts of, was found closed again behind the release, a thousand times.
TEST_CASE("rigid contacts: a mass at the origin is lifted off", "[events]") {
  for (const double g : {10.0, 9.81, 9.7, 1.0}) {
    const Problem given = make_problem(Scene::parse(fmt::format(R"toml(
[gravity]
y_m_per_s2 = {}
[point.P]
x_m = 0
y_m = 0
[mass.m]
point = "P"
mass_kg = 1
[force.f]
point = "P"
y_N = {{ kind = "polynomial", coefficients = [0, 20] }}
[contact.f]
kind = "rigid"
point = "P"
closed = true
[start]
given = ["P.x"]
[run]
t_end_s = 1
rtol = 1e-8
parameters = ["c"]
[[cost.terminal]]
kind = "value"
output = "P.y"
[parameter.c]
number = "force.f.y_N.coefficients[1]"
)toml",
                                                                -g),
                                                    "lifted.toml"));
    const double c = 20, left = 1 - g / c, psi = c * std::pow(left, 3) / 6,
                 derivative = std::pow(left, 3) / 6 + left * left * g / (2 * c);
    int rows = 0;
    for (const Formulation& f : formulations())
      for (const SensitivityMethod& m : sensitivity_methods()) {
        Problem p = given;
        p.formulation = f.name;
        if (!refusal(m, f).empty()) continue;
        CAPTURE(g, f.name, m.name);
        GradientResult r;
        try {
          r = gradient(p, m.name, p.parameters.values());
        } catch (const CapabilityError&) {  // methods of fixed steps want theirs
          continue;
        }
        ++rows;
        // Errors of some 60 rtol, of fixed steps 0.1 sqrt(rtol), of soft constraints 1/alpha.
        const double within =
            m.needs == SensitivityMethod::Needs::discrete || f.name.rfind("penalty", 0) == 0 ? 1e-4 : 6e-7;
        CHECK(std::abs(r.psi - psi) <= within * psi);
        CHECK(std::abs(r.gradient[0] - derivative) <= within * derivative);
        take_notices();
      }
    CHECK(rows > 25);
  }
}
