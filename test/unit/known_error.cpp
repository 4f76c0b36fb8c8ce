// What a run knows of its error, where that is all and where there may be more.
#include "costate/problem/known_error.h"

#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/confirmation.h"

using namespace costate;

namespace {
const char* const kFall = R"([point.P]
x_m = 0
y_m = 1
[mass.m]
point = "P"
mass_kg = 1
[gravity]
y_m_per_s2 = -9.81
[parameter.g]
number = "gravity.y_m_per_s2"
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "value"
output = "P.y"
[run]
t_end_s = 1
parameters = ["g"]
)";

GradientResult of(double psi, double slope) {
  GradientResult r;
  r.psi = psi;
  r.gradient = {slope};
  return r;
}
}  // namespace

TEST_CASE("known error: of a result that no other run confirms what was found is not all") {
  Problem problem = make_problem(Scene::parse(kFall, "fall.toml"));
  for (const double rtol : {1e-8, 1e-4}) {  // beside a looser run, and beside a tighter one
    CAPTURE(rtol);
    problem.solver.set_rtol(rtol);
    GradientResult found = of(-3.9, 0.5);
    widen_error(found, problem.parameters, 1e-12, 1e-12);
    take_notices();
    const GradientResult alone =
        confirmed(problem, found, [](const Problem&) -> GradientResult { throw SolverError("refused"); });
    CHECK(take_notices().size() == 1);
    REQUIRE(alone.known_error);
    CHECK_FALSE(alone.known_error->all);
    const GradientResult both = confirmed(problem, found, [](const Problem&) { return of(-3.9, 0.5); });
    REQUIRE(both.known_error);
    CHECK(both.known_error->all);
    take_notices();
  }
}
