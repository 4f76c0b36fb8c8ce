// An adjoint that is zero by its equations is what rounding leaves of it; and a driver that begins after a rest, whose
// first step's error is not to be judged by the rest.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

namespace {
Problem load(const std::string& scene) {
  return make_problem(Scene::load(fmt::format("{}/test/cases/{}.toml", COSTATE_SOURCE_DIR, scene)));
}
}  // namespace

// A sleeve turns about a fixed axis; its omega_y is then constant whatever the parameters: psi's gradient is zero.
TEST_CASE("an adjoint of the size of rounding is not followed", "[trivial]") {
  for (const auto& [formulation, method] : {std::pair{"maggi-implicit", "idas-adjoint"},
                                            {"maggi", "cvodes-adjoint"},
                                            {"baumgarte", "idas-adjoint"},
                                            {"index2", "idas-adjoint"}}) {
    CAPTURE(formulation, method);
    Problem p = load("adjoint_of_rounding");
    p.formulation = formulation;
    const GradientResult r = gradient(p, method, p.parameters.values());
    // psi = 2.1e-3 per metre of parameters of size 1 m; tolerance 1e-8.
    for (const double g : r.gradient) CHECK(std::abs(g) < 1e-8 * r.psi);
    CHECK(r.counters.backward_steps < 1000);
  }
}

// The right value: index2 and baumgarte on both integrators at 1e-10 to 1e-12 agree on it to 1e-8 of it. At 1e-8, with
// some hundred steps, 1e-4 is what every formulation keeps (of rtol neighbouring tolerances are off by 350 to 4,300);
// index1 on IDAS was off by just that at 1e-8 and at 1e-9 alike.
TEST_CASE("a driver that begins after a rest is followed to the tolerance", "[trivial]") {
  const double right = -0.0217778584;
  for (const double rtol : {1e-8, 1e-9, 1e-10}) {
    Problem p = load("late_from_rest");
    p.formulation = "index1";
    p.solver.integrator = "idas";
    p.solver.rtol = rtol;
    p.solver.atol = 0;
    CAPTURE(rtol);
    CHECK(std::abs(simulate(p, p.parameters.values()).psi - right) <= 1e4 * rtol * std::abs(right) + 1e-9);
    // Back over the same segments, also where they are run again: what a gradient keeps is a hundred times that.
    const double forward = gradient(p, "idas-forward", p.parameters.values()).gradient[0];
    for (const double budget_MB : {512.0, 1e-3}) {
      p.solver.memory_budget_MB = budget_MB;
      CAPTURE(budget_MB);
      CHECK(std::abs(gradient(p, "idas-adjoint", p.parameters.values()).gradient[0] - forward) <=
            3e3 * rtol * std::abs(forward));
    }
  }
}
