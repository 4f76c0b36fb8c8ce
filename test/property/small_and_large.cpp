// The same mechanism in nanometres and kilometres: start, motion and derivatives scale.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;

TEST_CASE("small and large: the start of what is of nanometres or kilometres has all its rows") {
  // 0.0428808 L^2, of the scene in metres; by an adjoint's absolute tolerance known to some 1e-4.
  const Problem p = problem_of_case("nanometres");
  for (const auto& [formulation, method] :
       {std::pair{"baumgarte", "cvodes-forward"}, {"index1", "idas-forward"}, {"index1", "hand-adjoint"}}) {
    INFO(formulation << " by " << method);
    Problem by = p;
    by.formulation = formulation;
    const GradientResult r = gradient(by, method, by.parameters.values());
    CHECK(r.gradient.back() == Approx(4.28808e-20).epsilon(1e-3));
    take_notices();
  }
  const Problem large = problem_of_case("ten_kilometres");
  CHECK_NOTHROW(simulate(large, large.parameters.values()));
  take_notices();
}
