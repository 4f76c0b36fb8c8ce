// Which method --accuracy takes on an integrator, by what it is said to cost.
#include "costate/tradeoff/gradient_price.h"

#include <catch2/catch.hpp>

using namespace costate;

TEST_CASE("gradient price: tangents of few parameters, an adjoint of many, later over bends") {
  const Formulation& f = find_formulation("baumgarte");
  const auto method = [&](const char* integrator, std::size_t parameters, bool bends) {
    return least_price(f, find_integrator(integrator), parameters, bends).method;
  };
  CHECK(method("idas", 1, false) == "idas-forward");
  CHECK(method("idas", 6, false) == "idas-adjoint");
  CHECK(method("cvodes", 4, false) == "cvodes-forward");
  CHECK(method("cvodes", 6, false) == "cvodes-adjoint");
  CHECK(method("cvodes", 12, true) == "cvodes-forward");
  CHECK(method("cvodes", 24, true) == "cvodes-adjoint");
  CHECK(method("dop853", 1, false) == "discrete-adjoint");
  // More parameters never cost less, nor do bends, and an adjoint's price is that of any number.
  for (const char* integrator : {"idas", "cvodes", "radau5", "dop853"})
    for (const bool bends : {false, true}) {
      double before = 0;
      for (const std::size_t n : {1, 2, 5, 20, 100, 1000}) {
        const GradientPrice p = least_price(f, find_integrator(integrator), n, bends);
        CAPTURE(integrator, bends, n, p.method, p.runs);
        CHECK(p.runs >= before);
        CHECK(p.runs >= least_price(f, find_integrator(integrator), n, false).runs);
        before = p.runs;
      }
      CHECK(least_price(f, find_integrator(integrator), 100, bends).runs == before);
    }
}
