// A rod that leans on its foot falls, and its foot begins to slide from rest: its slip of 1e-9 m/s is a sum of
// velocities of 0.5 m/s; so is that of a sphere that rolls. Gradients by all ways back against independent programs,
// and their cost.
#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "costate/base/notice.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;

namespace {

// Newton and Euler's equations of the rod about its foot, by scipy 1.10: held until |F_t| = mu N (DOP853 at 1e-12),
// then with friction along the slip, which begins with 1e-8 m/s (Radau at 1e-10; psi goes with this as 5e-2 of it).
// Gradients by extrapolated differences.
constexpr double kPsi = 1.74472872557, kGradient[] = {-6.72302995, 0.75062432, 2.92918274, -27.7856764};

struct Way {
  const char *formulation, *method;
};

}  // namespace

// idas-adjoint took 70 steps back for one at 1e-8 and stood still at 1e-10, cvodes-adjoint refused at 1e-8.
TEST_CASE("leaning rod: its foot begins to slide from rest, by all ways back", "[events]") {
  for (const Way& way :
       {Way{"index1", "idas-adjoint"}, Way{"index2", "idas-adjoint"}, Way{"baumgarte", "idas-adjoint"},
        Way{"index1", "cvodes-adjoint"}, Way{"baumgarte", "hand-adjoint"}, Way{"index1", "cvodes-forward"}})
    for (const double rtol : {1e-8, 1e-10}) {
      CAPTURE(way.formulation, way.method, rtol);
      Problem p = problem_of_case("leaning_rod");
      p.formulation = way.formulation;
      p.solver.integrator.clear();
      p.solver.rtol = rtol;
      p.solver.confirm = false;
      const GradientResult r = gradient(p, way.method, p.parameters.values());
      // Some hundred tolerances, as of other events, and the oracle's digits.
      CHECK(std::abs(r.psi - kPsi) <= 1e3 * rtol + 1e-9);
      for (std::size_t j = 0; j < 4; ++j) {
        CAPTURE(j);
        CHECK(std::abs(r.gradient[j] - kGradient[j]) <= (1e3 * rtol + 1e-7) * std::abs(kGradient[j]));
      }
      CHECK(r.counters.backward_steps <= 4 * r.counters.steps);
      take_notices();
    }
}

// What it slips with is the sum of larger velocities there, and where it rolls again. Adjoints stood still, at either
// end, in more than 90 s.
TEST_CASE("leaning rod: a sphere with a rotor that rolls slips from rest, and rolls again", "[events]") {
  // By an independent program, of its own equations, until 0.2 s.
  Problem p = problem_of_case("rolling_sphere_slips", {"run.t_end_s=0.2"});
  p.solver.confirm = false;
  CHECK(std::abs(gradient(p, "cvodes-adjoint", p.parameters.values()).psi - 0.85248271425) <= 1e-8);
  // Each against tangents that are integrated with the motion: what the slip stops with is known to its errors.
  p = problem_of_case("rolling_sphere_slips");
  p.solver.confirm = false;
  const auto rho = p.parameters.values();
  p.formulation = "baumgarte";
  const GradientResult right = gradient(p, "cvodes-forward", rho);
  for (const Way& way :
       {Way{"index1", "cvodes-adjoint"}, Way{"baumgarte", "idas-adjoint"}, Way{"index1", "hand-adjoint"}}) {
    p.formulation = way.formulation;
    const GradientResult r = gradient(p, way.method, rho);
    for (std::size_t j = 0; j < rho.size(); ++j) {
      CAPTURE(way.formulation, way.method, j, r.gradient[j], right.gradient[j]);
      CHECK(std::abs(r.gradient[j] - right.gradient[j]) <= 2e-5 * std::abs(right.gradient[j]));
    }
    CHECK(r.counters.backward_steps <= 4 * r.counters.steps);
  }
  take_notices();
}
