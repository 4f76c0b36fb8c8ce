// A gradient with respect to nothing: psi, by every method of every formulation.
#include <support/models.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/sensitivity/method.h"

using namespace costate;
using namespace costate::test;

TEST_CASE("gradient: without parameters every method gives psi") {
  for (const Formulation& f : formulations())
    for (const SensitivityMethod& method : sensitivity_methods()) {
      INFO(f.name << ", " << method.name);
      if (!refusal(method, f).empty()) continue;
      Problem p = five_bar().problem(f.name, 1e-6);
      p.parameters = {};
      p.solver.t_end = 0.05;
      const GradientResult r = gradient(p, method.name, {});
      CHECK(r.gradient.empty());
      CHECK(std::isfinite(r.psi));
      CHECK(r.psi > 0);
    }
}
