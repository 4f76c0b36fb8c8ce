// What is asked of gradients of the steps that Runge-Kutta schemes took, explicit (explicit_schemes.cpp) or implicit
// (radau_schemes.cpp).
//
// Tolerances. kTransposeOfSteps: tangent and adjoint form the same sums in another order, or solve the same systems and
// their transposes, apart by rounding of terms that are some tens of times the result (the weights a_ij of the scheme
// of order 8 reach 43): 1e-11. kDifferenceOfSteps: psi of a sequence of steps carries roundings of about 1e-13 of
// itself, or what Newton's iteration leaves of that size, so that extrapolated differences with steps of 2e-3 of a
// parameter's scale are good to 1e-9 where the parameter counts, as for fixed steps (discrete.cpp).
#pragma once

#include <fmt/format.h>
#include <support/models.h>

#include <catch2/catch.hpp>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"
#include "driven_carriage.h"
#include "gradient_compare.h"
#include "support/paths.h"

namespace costate::test {

inline constexpr double kTransposeOfSteps = 1e-11, kDifferenceOfSteps = 1e-9;

inline Problem on_scheme(const TestModel& model, const std::string& formulation, const std::string& scheme, double rtol,
                         double t_end = 0) {
  Problem p = model.problem(formulation, rtol);
  p.parameters = model.all_parameters();
  p.solver.integrator = scheme;
  p.solver.confirm = false;
  if (t_end > 0) p.solver.t_end = t_end;
  return p;
}

inline double apart_in_scales(const std::vector<double>& a, const std::vector<double>& b, const Problem& p) {
  return gradient_mismatch(a, b, p.parameters).error;
}

/// `psi`: how far both runs' psi may be apart, relative.
inline void check_transposed(const Problem& p, double psi) {
  const auto rho = p.parameters.values();
  const GradientResult tangent = gradient(p, "discrete-tangent", rho), adjoint = gradient(p, "discrete-adjoint", rho);
  CHECK(tangent.integrator == p.solver.integrator);
  CHECK(adjoint.integrator == p.solver.integrator);
  CHECK(tangent.psi == Approx(adjoint.psi).epsilon(psi));
  CHECK(apart_in_scales(adjoint.gradient, tangent.gradient, p) <= kTransposeOfSteps);
}

/// Against differences of psi over the very steps that the run took. `Held` is made of the problem and has psi(rho).
/// False where the run has jumps, Maggi's changes of coordinates, which cannot be held.
template <class Held>
bool check_over_held_steps(const Problem& p) {
  const auto rho = p.parameters.values();
  const GradientResult adjoint = gradient(p, "discrete-adjoint", rho);
  if (adjoint.counters.jumps > 0) return false;
  Held held(p);
  CHECK(held.psi(rho) == Approx(adjoint.psi).epsilon(1e-12));
  const std::vector<double> by_differences =
      gradient_by_differences([&](const std::vector<double>& x) { return held.psi(x); }, rho, p.parameters);
  CHECK(apart_in_scales(adjoint.gradient, by_differences, p) <= kDifferenceOfSteps);
  return true;
}

/// Stages kept, computed again over three steps each, and over as many as `budget_MB` holds.
inline void check_computed_again(Problem p, double budget_MB) {
  const auto rho = p.parameters.values();
  const GradientResult kept = gradient(p, "discrete-adjoint", rho);
  CHECK(kept.counters.checkpoints == 0);
  p.solver.checkpoint_steps = 3;
  const GradientResult repeated = gradient(p, "discrete-adjoint", rho);
  CAPTURE(kept.counters.steps, kept.counters.jumps);
  CHECK(repeated.counters.checkpoints == (kept.counters.steps + 2) / 3);
  CHECK(repeated.counters.backward_residuals > kept.counters.backward_residuals);
  CHECK(apart_in_scales(repeated.gradient, kept.gradient, p) <= kTransposeOfSteps);
  p.solver.checkpoint_steps = 0;
  p.solver.memory_budget_MB = budget_MB;
  const GradientResult small = gradient(p, "discrete-adjoint", rho);
  CHECK(small.counters.checkpoints > 1);
  CHECK(apart_in_scales(small.gradient, kept.gradient, p) <= kTransposeOfSteps);
}

/// Across the kinks of a driver, against differences of whole motions.
inline void check_kinks_met(const std::vector<std::string>& formulations, const std::vector<std::string>& schemes) {
  const std::string law = R"({ kind = "bump", height_m = 0.15, start_m = 0.3, length_m = 0.5, shape = "half_sine" })";
  Problem p = make_problem(Scene::parse(driven_carriage(law), "driver.toml"),
                           {"spring.strut.stiffness_N_per_m", "body.rod.mass_kg", "driver.push.law.height_m"});
  p.formulation = "index1";
  const auto rho = p.parameters.values();
  const GradientResult oracle = gradient(p, "differences", rho);
  for (const std::string& formulation : formulations)
    for (const std::string& scheme : schemes)
      for (const char* method : {"discrete-tangent", "discrete-adjoint"}) {
        p.formulation = formulation;
        p.solver.integrator = scheme;
        CAPTURE(formulation, scheme, method);
        const GradientResult r = gradient(p, method, rho);
        CHECK(r.counters.jumps >= 2);
        CHECK(r.psi == Approx(oracle.psi).epsilon(1e-6));
        const auto mismatch = gradient_mismatch(r.gradient, oracle.gradient, p.parameters);
        INFO(mismatch.text);
        CHECK(mismatch.error < 1e-6);  // as in driver_kinks.cpp
      }
}

/// A ball that bounces, against CVODES. The last hop takes 6 ms, between flights whose steps an error estimate would
/// not bound: parabolas are exact.
inline void check_events_met(const std::vector<std::string>& schemes) {
  Problem p = make_problem(Scene::load(fmt::format("{}/models/bouncing_ball/bouncing_ball.toml", COSTATE_SOURCE_DIR)));
  p.formulation = "baumgarte";
  p.solver.integrator = "cvodes";
  const auto rho = p.parameters.values();
  const Simulation right = simulate(p, rho);
  REQUIRE(right.events.size() >= 17);
  for (const std::string& scheme : schemes) {
    p.solver.integrator = scheme;
    const Simulation r = simulate(p, rho);
    CAPTURE(scheme, p.solver.rtol);
    // Sixteen times the ball gives back less than it has: errors of 1e2 rtol grow to 1e4.
    CHECK(r.psi == Approx(right.psi).epsilon(1e-6));
    REQUIRE(r.events.size() == right.events.size());
    for (std::size_t i = 0; i < r.events.size(); ++i) CHECK(r.events[i].t == Approx(right.events[i].t).epsilon(1e-5));
  }
}

}  // namespace costate::test
