// psi's stated error over a motion whose forces bend: a wheel that leaves a rough road and comes down again. The value
// is that of scipy (Dormand and Prince of order 8, rtol 1e-12, steps of 5e-4 s at most) and of radau5 at 1e-10.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/problem/scene_problem.h"
#include "costate/tradeoff/motion_confirmation.h"
#include "support/cases.h"

using namespace costate;

// A tenth of what a hundred times the tolerance changes was 2.8e-6, of an error of 2.3e-5; where forces bend errors
// are stated to a factor of three, as over events.
TEST_CASE("hopping wheel: the error stated of psi over bends is no three times too small") {
  const double right = 7.8761716;
  for (const char* integrator : {"cvodes", "idas"}) {
    CAPTURE(integrator);
    Problem p = problem_of_case("hopping_wheel");
    p.formulation = "maggi";
    p.solver.integrator = integrator;
    if (p.solver.integrator == "idas") p.formulation = "baumgarte";
    const Simulation r = confirmed_simulation(p, p.parameters.values(), {}, {});
    take_notices();
    REQUIRE(r.known_error);
    CAPTURE(r.psi, r.known_error->psi);
    CHECK(std::abs(r.psi - right) <= 3 * r.known_error->psi);
  }
}
