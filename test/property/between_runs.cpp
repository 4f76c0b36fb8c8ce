// What is remembered along a run is none of another one: the same call gives the same, whatever was run before.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;

TEST_CASE("between runs: the last angle of another run") {
  const Problem p = problem_of_case("yaw_of_runs");
  const GradientResult first = gradient(p, "idas-adjoint", {0.01});
  gradient(p, "idas-adjoint", {6});
  const GradientResult again = gradient(p, "idas-adjoint", {0.01});
  CHECK(first.psi == again.psi);
  // (-3 + 0.01 t)^2
  CHECK(again.psi == Approx(9 - 0.03 + 1e-4 / 3).epsilon(1e-7));
  take_notices();
}

TEST_CASE("between runs: a bushing that swings through zero") {
  const Problem p = problem_of_case("bushing_swing");
  for (int k = 0; k < 2; ++k) CHECK_NOTHROW(simulate(p, p.parameters.values()));
  take_notices();
}
