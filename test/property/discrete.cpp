// The discrete scheme and its exact derivatives: tangent and adjoint are transposes of each other, both are the
// derivative of the psi that the steps form, and what the steps promise about constraints, factorizations, memory and
// order holds.
//
// Tolerances. kTranspose: the same sums in another order, apart by rounding; 1e-12 is what the project asks for,
// five-bar and kitchen sink reach 1e-14. kDifference: psi carries rounding errors of about 1e-13 of itself (Newton's
// iteration ends at rounding), so that extrapolated differences with steps of 1e-3 of a parameter's scale are good to
// 1e-10 / the part that a parameter has in the gradient, of which the largest counts here.
#include <support/models.h>
#include <support/sketch.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/integrator/fixed_run.h"
#include "costate/sensitivity/method.h"
#include "gradient_compare.h"

using namespace costate;
using namespace costate::test;

namespace {

constexpr double kEps = 2.2e-16;
constexpr double kTranspose = 1e-12;
constexpr double kDifference = 1e-9;

struct Scheme {
  const char* name;
  double rho_infinity;
};
const std::vector<Scheme> schemes = {
    {"newmark", 0}, {"generalized-alpha", 0.0}, {"generalized-alpha", 0.7}, {"generalized-alpha", 1.0}};

Problem discrete(const TestModel& model, double step, const Scheme& scheme = schemes[0], double t_end = 0) {
  Problem p = model.problem("index3", 1e-8);
  p.parameters = model.all_parameters();
  p.solver.step_s = step;
  if (t_end > 0) p.solver.t_end = t_end;
  p.formulation_options.set("discrete_scheme", scheme.name);
  p.formulation_options.set("discrete_rho_infinity", scheme.rho_infinity);
  return p;
}

double psi_of(const Problem& p, const std::vector<double>& rho) {
  FixedRun run(p, rho, fixed_steps(p), StartDerivative::none);
  return run.forward();
}

std::vector<double> gradient_by_differences(const Problem& p) {
  return test::gradient_by_differences([&](const std::vector<double>& rho) { return psi_of(p, rho); },
                                       p.parameters.values(), p.parameters);
}

/// Largest |Phi|, |Phidot|, |Phiddot| at the scheme's state, against the terms that they are sums of.
std::array<double, 3> violation(DiscreteScheme& scheme) {
  Assembly& a = scheme.assembly();
  const StateView s = scheme.state();
  a.calc_dynamics(s);
  std::vector<double> rate = a.phi_t, second = a.bias;
  add_product(a.jacobian(), a.phi_q.data(), 1, s.v, rate.data());
  add_product(a.jacobian(), a.phi_q.data(), 1, s.a, second.data());
  double phi_q = 0, q = 1, v = 0, acceleration = 0, terms = 0;
  for (const double x : a.phi_q) phi_q = std::max(phi_q, std::abs(x));
  for (int i = 0; i < a.n(); ++i) {
    q = std::max(q, std::abs(s.q[i]));
    v = std::max(v, std::abs(s.v[i]));
    acceleration = std::max(acceleration, std::abs(s.a[i]));
  }
  for (int i = 0; i < a.m(); ++i) terms = std::max({terms, std::abs(a.bias[i]), std::abs(a.phi_t[i])});
  std::array<double, 3> worst{};
  for (int i = 0; i < a.m(); ++i) {
    worst[0] = std::max(worst[0], std::abs(a.phi[i]) / (phi_q * q));
    worst[1] = std::max(worst[1], std::abs(rate[i]) / (phi_q * v + terms));
    worst[2] = std::max(worst[2], std::abs(second[i]) / (phi_q * acceleration + terms));
  }
  return worst;
}

}  // namespace

TEST_CASE("discrete: adjoint and tangent agree to rounding", "[discrete]") {
  for (const auto& scheme : schemes)
    for (const auto& [model, step] : {std::pair{five_bar(), 0.01},
                                      {kitchen_sink(), 0.01},
                                      {kitchen_sink_without_accelerations(), 0.02},
                                      {four_bars(5, 0.4), 0.005},
                                      {chain(8, 0.5), 0.005},
                                      {pendulum(1, 2), 0.01}}) {
      const Problem p = discrete(model, step, scheme);
      CAPTURE(model.name, scheme.name, scheme.rho_infinity);
      const auto rho = p.parameters.values();
      const GradientResult tangent = gradient(p, "discrete-tangent", rho),
                           adjoint = gradient(p, "discrete-adjoint", rho);
      CHECK(tangent.psi == adjoint.psi);
      CHECK(tangent.integrator == "fixed");
      CHECK(gradient_mismatch(adjoint.gradient, tangent.gradient, p.parameters).error <= kTranspose);
    }
}

TEST_CASE("discrete: the tangent is the derivative of the discrete psi", "[discrete]") {
  for (const auto& scheme : {schemes[0], schemes[2]}) {
    // Steps that are far too large for the motion: the gradient is that of psi all the same.
    for (const auto& [model, step, t_end] : {std::tuple{five_bar(), 0.05, 2.0},
                                             {kitchen_sink(), 0.02, 0.6},
                                             {four_bars(2, 0.3), 0.01, 0.0},
                                             {pendulum(1, 2), 0.04, 0.0}}) {
      const Problem p = discrete(model, step, scheme, t_end);
      CAPTURE(model.name, scheme.name);
      const auto rho = p.parameters.values();
      const GradientResult tangent = gradient(p, "discrete-tangent", rho);
      CHECK(tangent.psi == psi_of(p, rho));
      CHECK(gradient_mismatch(tangent.gradient, gradient_by_differences(p), p.parameters).error <= kDifference);
    }
  }
}

TEST_CASE("discrete: constraints hold at all three levels after each step", "[discrete]") {
  for (const auto& scheme : {schemes[0], schemes[2]})
    for (const auto& [model, step] :
         {std::pair{five_bar(), 0.01}, {kitchen_sink(), 0.01}, {four_bars(10, 0.4), 0.005}}) {
      const Problem p = discrete(model, step, scheme);
      CAPTURE(model.name, scheme.name);
      FixedRun run(p, p.parameters.values(), fixed_steps(p), StartDerivative::none);
      std::array<double, 3> worst{};
      run.forward([&](long) {
        const auto now = violation(run.scheme());
        for (int i = 0; i < 3; ++i) worst[i] = std::max(worst[i], now[i]);
      });
      CAPTURE(worst[0], worst[1], worst[2]);
      // Newton ends at 32 eps of the coordinates; the projections are direct solves.
      CHECK(worst[0] <= 64 * kEps);
      CHECK(worst[1] <= 64 * kEps);
      CHECK(worst[2] <= 256 * kEps);
    }
}

TEST_CASE("discrete: generalized-alpha without damping is the trapezoidal rule", "[discrete]") {
  for (const auto& model : {five_bar(), kitchen_sink()}) {
    const Problem newmark = discrete(model, 0.01, schemes[0], 1), alpha = discrete(model, 0.01, schemes[3], 1);
    const auto rho = newmark.parameters.values();
    const GradientResult a = gradient(newmark, "discrete-adjoint", rho), b = gradient(alpha, "discrete-adjoint", rho);
    CHECK(b.psi == Approx(a.psi).epsilon(1e-11));
    CHECK(gradient_mismatch(a.gradient, b.gradient, newmark.parameters).error <= 1e-10);
  }
}

TEST_CASE("discrete: two factorizations a step serve everything", "[discrete]") {
  const Problem p = discrete(five_bar(), 0.01);
  const auto rho = p.parameters.values();
  const long steps = 500;
  // Both matrices once at the start and once a step.
  for (const char* method : {"discrete-tangent", "discrete-adjoint"}) {
    const GradientResult r = gradient(p, method, rho);
    CHECK(r.counters.steps == steps);
    // Going back to the start takes one more, since records there come without factors.
    const long more = std::string(method) == "discrete-adjoint" ? 1 : 0;
    CHECK(r.counters.factorizations == 2 * (steps + 1) + more);
    CHECK(r.counters.jacobians == steps + 1);
    CHECK(r.counters.newton_iterations <= 5 * steps);
  }
  CHECK(gradient(p, "discrete-adjoint", rho).counters.backward_steps == steps);
}

TEST_CASE("discrete: the adjoint works within its memory", "[discrete]") {
  for (const auto& scheme : {schemes[0], schemes[2]}) {
    Problem p = discrete(kitchen_sink(), 0.005, scheme);
    const auto rho = p.parameters.values();
    const GradientResult all = gradient(p, "discrete-adjoint", rho);
    CHECK(all.counters.checkpoints == 1);
    CHECK(all.counters.backward_newton_iterations == 0);
    const auto same = [&](const GradientResult& r) {
      CHECK(r.psi == all.psi);
      CHECK(gradient_mismatch(r.gradient, all.gradient, p.parameters).error <= kTranspose);
    };
    // Records without factors.
    p.solver.memory_budget_MB = 200 * 200 * 8e-6;
    const GradientResult records = gradient(p, "discrete-adjoint", rho);
    CHECK(records.counters.checkpoints == 1);
    CHECK(records.counters.factorizations > 3 * 200);
    same(records);
    // Not even the records.
    p.solver.memory_budget_MB = 0.02;
    const GradientResult few = gradient(p, "discrete-adjoint", rho);
    CHECK(few.counters.checkpoints > 1);
    same(few);
    // Segments of a length that does not divide the number of steps.
    p.solver.memory_budget_MB = 512;
    p.solver.checkpoint_steps = 37;
    const GradientResult segments = gradient(p, "discrete-adjoint", rho);
    CHECK(segments.counters.checkpoints == 6);
    same(segments);
  }
}

TEST_CASE("discrete: redundant constraints are refused by name", "[discrete]") {
  Sketch s;
  s.builder.set_gravity(0, -9.81);
  s.ground("A", 0, 0);
  s.ground("B", 1, 0);
  s.ground("C", 2, 0);
  s.point("P", 0, 1, 0.1, 0);
  s.point("Q", 1, 1);
  s.point("R", 2, 1);
  s.bar("left", "A", "P", 1);
  s.bar("middle", "B", "Q", 1);
  s.bar("right", "C", "R", 1);
  s.bar("top", "P", "Q", 1);
  s.bar("top2", "Q", "R", 1);
  s.distance("strut", "P", "R");  // says nothing new
  s.give({"P.x"});
  s.numbers("cost", {{"weight", 1}});
  s.parameter("weight", "cost.weight");
  s.builder.set_default_parameters({"weight"});
  TestModel model{"redundant", s.builder.build(), {}, 1};
  const Problem p = discrete(model, 0.01);
  try {
    gradient(p, "discrete-tangent", p.parameters.values());
    FAIL("redundancy went unnoticed");
  } catch (const SolverError& e) {
    CHECK_THAT(e.what(), Catch::Contains("1 of 6 constraint rows") && Catch::Contains(".length"));
  }
}

TEST_CASE("discrete: a failing step says where and what", "[discrete]") {
  const Problem p = discrete(four_bars(2, 3), 0.4);
  try {
    psi_of(p, p.parameters.values());
    FAIL("so large a step cannot converge");
  } catch (const SolverError& e) {
    CHECK_THAT(e.what(), Catch::Contains("step ") && Catch::Contains("t = ") && Catch::Contains("B"));
  }
}

TEST_CASE("discrete: an impossible option is refused", "[discrete]") {
  CHECK_THROWS_AS(discrete(pendulum(1, 1), 0.01, {"generalized-alpha", 1.2}), CapabilityError);
  Problem p = discrete(pendulum(1, 1), 0.01, {"generalized-alpha", 0.8});
  CHECK_THROWS_WITH(p.formulation_options.set("discrete_scheme", "newmarc"), Catch::Contains("newmark"));
  p.formulation = "maggi";  // has no residual
  CHECK_THROWS_WITH(gradient(p, "idas-adjoint", {1, 1}),
                    Catch::Contains("Nearest that works") && Catch::Contains("method 'idas-adjoint' with"));
}
