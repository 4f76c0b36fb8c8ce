// A tolerance that promises no digit is said to be one.
#include <support/models.h>

#include <catch2/catch.hpp>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"

using namespace costate;
using namespace costate::test;
using Catch::Matchers::Contains;

TEST_CASE("simulate: from rtol 1e-2 on a run says that none of its digits is promised") {
  for (const char* integrator : {"idas", "cvodes"})
    for (const double rtol : {1e-1, 1e-2, 1e-3}) {
      INFO(integrator << ", " << rtol);
      Problem p = five_bar().problem("baumgarte", rtol);
      p.solver.integrator = integrator;
      p.solver.t_end = 0.5;
      take_notices();
      simulate(p, p.parameters.values());
      const auto said = take_notices();
      if (rtol < 1e-2) {
        CHECK(said.empty());
      } else {
        REQUIRE(said.size() == 1);
        CHECK_THAT(said[0], Contains("no digit") && Contains("smaller rtol"));
      }
    }
}
