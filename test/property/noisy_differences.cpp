// Differences of a psi that is not smooth: the change of the entry that changed least, of many, tells no error.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

// psi = x^3 and, as other steps from run to run make, something below 1e-11 that no two runs share. With the change of
// the best entry alone 18 of 40 derivatives were off by more than what was stated, 4 by more than twice that.
TEST_CASE("differences: errors hold where psi is rough") {
  int beyond = 0, twice = 0;
  for (int k = 0; k < 40; ++k) {
    const double x = 0.7 + 0.0137 * k;
    const Problem p = make_problem(Scene::parse(fmt::format(R"toml([point.P]
x_m = {}
y_m = 0
[mass.m]
point = "P"
mass_kg = 1
[output.o]
formula = "P.x^3 + 1e-11*sin({}*P.x)"
unit = "1"
[[cost.terminal]]
kind = "value"
output = "o"
[parameter.x]
number = "point.P.x_m"
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 0.1
parameters = ["x"]
rtol = 1e-9
)toml",
                                                            x, 1e7 + 1234567.0 * k),
                                                "rough.toml"));
    const GradientResult r = gradient(p, "differences", p.parameters.values());
    const double off = std::abs(r.gradient[0] - 3 * x * x) / r.gradient_error[0];
    CHECK(r.gradient_error[0] < 1e-6);
    beyond += off > 1;
    twice += off > 2;
  }
  CHECK(beyond <= 4);
  CHECK(twice <= 1);
}
