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

TEST_CASE(
    "hidden jumps: a parameter that moves a jump of a driver's acceleration is refused, another has its gradient") {
  // x = v u |u|/2: index1 said 0 of t0, baumgarte -1.493 and maggi -1.540, each with errors of 1e-6 told, for -1.557.
  const auto by = [](const char* parameter) {
    return problem_of_case(
        "driven_pendulum",
        {R"law(driver.x.law={kind="formula",formula="v*(t-t0)*(t-t0+sqrt((t-t0)^2))/2",v=0.8,t0=1.0371})law",
         fmt::format(R"(run.parameters=["{}"])", parameter)});
  };
  for (const auto& [formulation, method] : {std::pair("index1", "idas-adjoint"), std::pair("baumgarte", "hand-adjoint"),
                                            std::pair("maggi", "cvodes-forward")}) {
    CAPTURE(formulation);
    Problem moved = by("driver.x.law.t0");
    moved.formulation = formulation;
    CHECK_THROWS_WITH(gradient(moved, method, moved.parameters.values()),
                      Contains("'driver.x.law.t0' moves the time t = 1.0371 s") && Contains("second derivative"));
    Problem larger = by("driver.x.law.v");
    larger.formulation = formulation;
    const GradientResult g = gradient(larger, method, larger.parameters.values()),
                         d = gradient(larger, "differences", larger.parameters.values());
    CHECK(g.gradient[0] == Approx(d.gradient[0]).epsilon(1e-5));
  }
}

TEST_CASE("hidden jumps: a law that the motion travels jumps where its formula does not show") {
  // By maggi the derivative by w had been -0.127, with 1e-8 told, for 0.108.
  const auto problem = [](std::vector<std::string> laws, double end) {
    laws.push_back(fmt::format("run.t_end_s={}", end));
    Problem p = problem_of_case("formula_spring", laws);
    p.parameters = p.mechanism->select({"mass.m.mass_kg"});
    return p;
  };
  using Laws = std::vector<std::string>;
  const Laws spring = {},
             damper = {"spring.s.spring_law=1.0",
                       R"law(spring.s.damper_law={kind="formula",formula="a*atan(tan(w*x))",a=0.1,w=1.7})law"},
             scaled = {R"law(spring.s.spring_law={kind="scaled",law={kind="formula",formula="a*atan(tan(w*x))",)law"
                       R"law(a=0.1,w=1.2},slope=2,nominal_slope=1})law"};
  // The spring's x = pi/2.4 is passed after some 1.3 s, the damper's pi/3.4 m/s as the speed falls from 1 m/s.
  for (const char* method : {"idas-adjoint", "hand-adjoint", "cvodes-forward", "discrete-adjoint"})
    for (const Laws& laws : {spring, damper, scaled}) {
      CAPTURE(method, laws);
      Problem p = problem(laws, 2);
      CHECK_THROWS_WITH(gradient(p, method, p.parameters.values()),
                        Contains("'spring.s.") && Contains("as its formula does not show"));
      p = problem(laws, 0.05);
      CHECK_NOTHROW(gradient(p, method, p.parameters.values()));
    }
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
