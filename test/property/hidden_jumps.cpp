// Laws of time with features that no operation of theirs shows, or that are short against the run: refused where
// derivatives would miss them, and right where they are smooth.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "costate/integrator/simulate.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;
using Catch::Contains;

TEST_CASE("hidden jumps: a parameter that moves the jump of a formula of time is refused") {
  for (const char* method : {"idas-adjoint", "cvodes-forward", "hand-adjoint", "discrete-adjoint"}) {
    CAPTURE(method);
    for (const char* name : {"couple.c.w", "actuator.m.v"}) {
      Problem p = problem_of_case("formulas_of_time");
      p.parameters = p.mechanism->select({name});
      CHECK_THROWS_WITH(gradient(p, method, p.parameters.values()),
                        Contains(std::string("'") + name + "' moves the time t = 1.") && Contains("has a jump"));
    }
    // One that only makes it larger has its derivative: 1.2 t up to the jump, pi less behind it; w' = a f/I, and a
    // second integral over 2 s.
    Problem p = problem_of_case("formulas_of_time", {"actuator.m.b=0"});
    p.parameters = p.mechanism->select({"couple.c.a"});
    const double t = std::numbers::pi / 2.4, by_slope = 1.2 * 8 / 6.0,
                 by_jump = std::numbers::pi * (2 - t) * (2 - t) / 2;
    const GradientResult g = gradient(p, method, p.parameters.values());
    CHECK(g.gradient[0] == Approx((by_slope - by_jump) / 0.5).epsilon(1e-6));
  }
}

TEST_CASE("hidden jumps: a kink of a driver that its formula does not show is refused in every run") {
  const auto driven = [](const std::string& law) {
    Problem p = problem_of_case("driven_pendulum", {"driver.x.law=" + law, R"(run.parameters=["driver.x.law.v"])"});
    p.formulation = "maggi";
    return p;
  };
  for (const char* bend : {"sqrt((t-1)^2)", "((t-1)^2)^0.5"}) {
    CAPTURE(bend);
    const Problem kinked = driven(fmt::format(R"law({{kind="formula",formula="v*(t-1+{})/2",v=0.8}})law", bend));
    const auto rho = kinked.parameters.values();
    CHECK_THROWS_WITH(simulate(kinked, rho), Contains("'driver.x' has a kink at t = 1 s") && Contains(" to 0.8"));
    CHECK_THROWS_WITH(gradient(kinked, "hand-adjoint", rho), Contains("has a kink"));
  }
  const Problem jumping = driven(R"law({kind="formula",formula="v*atan(tan(2*t))",v=0.8})law");
  CHECK_THROWS_WITH(simulate(jumping, jumping.parameters.values()), Contains("has a jump at t = 0.785398163 s"));
  const Problem smooth = driven(R"law({kind="formula",formula="v*(t-1+sqrt((t-1)^2+1e-4))/2",v=0.8})law");
  CHECK_NOTHROW(gradient(smooth, "hand-adjoint", smooth.parameters.values()));
}

TEST_CASE("hidden jumps: a short smooth step of a driver has its places as parameters") {
  // A quintic meets its levels whatever its numbers are; the two ways differ by what tolerances leave of accelerations
  // that its width makes large.
  Problem p = problem_of_case("driven_pendulum");
  const auto rho = p.parameters.values();
  p.formulation = "maggi";
  const GradientResult forward = gradient(p, "cvodes-forward", rho);
  p.formulation = "index1";
  p.solver.rtol = 1e-10;
  const GradientResult back = gradient(p, "idas-adjoint", rho);
  for (std::size_t j = 0; j < rho.size(); ++j) CHECK(forward.gradient[j] == Approx(back.gradient[j]).epsilon(1e-5));
}

TEST_CASE("hidden jumps: an adjoint that comes to a short pulse from a long way has its error in sight") {
  // Closed forms: of x = 3 (T - (from + to)/2)^2/2 + 3 (to - from)^2/56 behind a quintic, the variance of whose slope
  // is 1/28 of its width squared; of ten times y, that ends at `at` + width. 3.7e-4 of at[0] had been lost at every
  // tolerance from 1e-7 to 1e-9, with 8e-7 told.
  constexpr double force = 3, end = 12, from = 10, width = 1e-3, way = end - from - width / 2;
  const std::vector<double> right = {
      -force * way / 2 - force * width / 28,        -force * way / 2 + force * width / 28,
      way * way / 2 + width * width / 56,           -10 * force * way,
      10 * (-force * way / 2 + force * width / 28), 10 * (way * way / 2 + width * width / 56)};
  for (const char* method : {"idas-adjoint", "cvodes-adjoint"})
    for (const double rtol : {1e-8, 1e-9}) {
      CAPTURE(method, rtol);
      Problem p = problem_of_case("late_push");
      p.solver.rtol = rtol;
      const GradientResult g = gradient(p, method, p.parameters.values());
      // 200 rtol of what a change of each parameter by its size does to psi, as an adjoint costs.
      for (std::size_t j = 0; j < right.size(); ++j) {
        CAPTURE(p.parameters.parameters[j].name);
        CHECK(std::abs(g.gradient[j] - right[j]) * p.parameters.parameters[j].scale <= 200 * rtol * 600);
      }
    }
}
