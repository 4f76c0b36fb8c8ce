// Adjoints of accelerations are those of velocities over masses: beside light ones their tolerances are as large.
#include <catch2/catch.hpp>

#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

TEST_CASE("light adjoints: three milligrams slide and strike, by IDAS", "[events]") {
  constexpr double kEnd = 0.04, kSpeed = 0.15, kFriction = 0.2, kSlowed = 1e-4 - 5e-4 + 0.5 * 9.81 * kEnd * kEnd;
  for (const char* formulation : {"index1", "index2", "penalty", "baumgarte"})
    for (const double rtol : {1e-6, 1e-8, 1e-10}) {
      CAPTURE(formulation, rtol);
      Problem p = make_problem(Scene::load(COSTATE_SOURCE_DIR "/test/cases/light_bar.toml"));
      p.formulation = formulation;
      p.solver.set_rtol(rtol);
      p.solver.confirm = false;
      const GradientResult r = gradient(p, "idas-adjoint", p.parameters.values());
      // Some ten events, of ten steps of the tolerance each.
      const double allowed = 100 * rtol;
      CHECK(r.psi == Approx(kSpeed * kEnd - kFriction * kSlowed).epsilon(allowed));
      CHECK(r.gradient[0] == Approx(-kSlowed).epsilon(allowed));
      CHECK(r.gradient[1] == Approx(kEnd).epsilon(allowed));
    }
}
