// Tyres whose damper cuts the force off while they are still pressed: where the force comes back, and is gone again,
// within what would be one step, or is cut off so. cvodes stepped over it at every tolerance: psi was 3e-8 of itself
// off, and gradients forty to ninety times what they stated.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

TEST_CASE("brief presses: a tyre that presses again for a fifth of a millisecond, by every method") {
  // What discrete tangents on radau5 (baumgarte, rtol 1e-9 to 1e-13) and idas-forward (1e-13) agree on to 1e-9.
  constexpr double psi = 0.0470497298563, slope = -3.500496894;
  Problem p = make_problem(Scene::load(COSTATE_SOURCE_DIR "/test/cases/trailer_hop.toml"));
  p.solver.confirm = false;
  struct Way {
    const char *formulation, *method;
  };
  // Over fifteen touches rtol grows to some 1e5 of itself; what was stepped over made 2.3e-5.
  for (const Way& way :
       {Way{"maggi", "cvodes-forward"}, Way{"maggi", "cvodes-adjoint"}, Way{"baumgarte", "cvodes-adjoint"},
        Way{"maggi", "discrete-tangent"}, Way{"baumgarte", "hand-tangent"}}) {
    CAPTURE(way.formulation, way.method);
    p.formulation = way.formulation;
    const GradientResult r = gradient(p, way.method, p.parameters.values());
    CHECK(std::abs(r.psi / psi - 1) <= 1e5 * p.solver.rtol);
    CHECK(std::abs(r.gradient[0] / slope - 1) <= 1e6 * p.solver.rtol);
  }
  take_notices();
}
