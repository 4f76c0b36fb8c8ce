// What is remembered along a run is none of another one: the same call gives the same, whatever was run before.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

static Problem case_of(const std::string& name) {
  return make_problem(Scene::load(fmt::format("{}/test/cases/{}.toml", COSTATE_SOURCE_DIR, name)));
}

TEST_CASE("between runs: the last angle of another run") {
  const Problem p = case_of("yaw_of_runs");
  const GradientResult first = gradient(p, "idas-adjoint", {0.01});
  gradient(p, "idas-adjoint", {6});
  const GradientResult again = gradient(p, "idas-adjoint", {0.01});
  CHECK(first.psi == again.psi);
  // (-3 + 0.01 t)^2
  CHECK(again.psi == Approx(9 - 0.03 + 1e-4 / 3).epsilon(1e-7));
  take_notices();
}

TEST_CASE("between runs: a bushing that swings through zero") {
  const Problem p = case_of("bushing_swing");
  for (int k = 0; k < 2; ++k) CHECK_NOTHROW(simulate(p, p.parameters.values()));
  take_notices();
}
