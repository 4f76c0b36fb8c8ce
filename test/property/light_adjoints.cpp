// Adjoints of accelerations are those of velocities over masses: beside light ones their tolerances are as large.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/sensitivity/error_estimate.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;

TEST_CASE("light adjoints: three milligrams slide and strike, by IDAS", "[events]") {
  constexpr double kEnd = 0.04, kSpeed = 0.15, kFriction = 0.2, kSlowed = 1e-4 - 5e-4 + 0.5 * 9.81 * kEnd * kEnd;
  for (const char* formulation : {"index1", "index2", "penalty", "baumgarte"})
    for (const double rtol : {1e-6, 1e-8, 1e-10}) {
      CAPTURE(formulation, rtol);
      Problem p = problem_of_case("light_bar");
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

TEST_CASE("light adjoints: a step back that is shorter than rounding tells the gradient's integral, too", "[events]") {
  // An elastic bounce: psi = -v. IDAS gave no gradient of the run that was to tell the error (IDA_BAD_T).
  Problem p = problem_of_case("touch_at_a_tenth");
  p.formulation = "baumgarte";
  p.solver.confirm = false;
  const auto rho = p.parameters.values();
  for (const double rtol : {1e-9, 1e-10}) {
    p.solver.set_rtol(rtol);
    const GradientResult r = gradient(p, "idas-adjoint", rho);
    const ErrorEstimate e = estimate_error(p, "idas-adjoint", rho, r);
    take_notices();
    CAPTURE(rtol, r.psi, r.gradient[1], e.psi, e.gradient[1]);
    CHECK(std::abs(r.psi - 1) <= 3 * e.psi);
    CHECK(std::abs(r.gradient[1] + 1) <= 3 * e.gradient[1]);
  }
}
