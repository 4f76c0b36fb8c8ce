// Accelerations and multipliers are unknowns whose error IDAS does not control, in index 2 not even Newton's iteration:
// adjoints along its motions take those that are solved for. And end values of adjoints that the constraints carry in
// full, so that what is left is rounding. Against Baumgarte's ODE and its adjoint on CVODES at a hundredth of the
// tolerance.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"
#include "property/gradient_compare.h"
#include "support/paths.h"

using namespace costate;

namespace {

Problem case_problem(const std::string& name) {
  return make_problem(Scene::load(fmt::format("{}/test/cases/{}.toml", COSTATE_SOURCE_DIR, name)));
}

void check_against_baumgarte(const std::string& name, double rtol) {
  Problem problem = case_problem(name);
  const auto rho = problem.parameters.values();
  problem.formulation = "baumgarte";
  problem.solver.rtol = 1e-2 * std::min(rtol, 1e-8);
  const GradientResult expected = gradient(problem, "cvodes-adjoint", rho);
  problem.solver.rtol = rtol;
  for (const char* formulation : {"index2", "index3"}) {
    INFO(name << " " << formulation << ", rtol " << rtol);
    problem.formulation = formulation;
    const GradientResult r = gradient(problem, "idas-adjoint", rho);
    const auto mismatch = test::gradient_mismatch(r.gradient, expected.gradient, problem.parameters);
    INFO(mismatch.text);
    // A thousand times rtol, what an adjoint on IDAS costs (docs); of the oracle's own 1e-10 no more than that.
    CHECK(mismatch.error < 1e3 * std::max(rtol, 1e-10));
  }
}

}  // namespace

TEST_CASE("index 2 on IDAS: adjoints do not see the noise of accelerations that are in no norm") {
  // Without constraints nothing else ties the accelerations down; the mass is multiplied by them.
  for (const char* name : {"no_constraints", "mass_term"})
    for (const double rtol : {1e-6, 1e-8, 1e-11}) check_against_baumgarte(name, rtol);
}

TEST_CASE("index 2 on IDAS: adjoints begin where drivers or costs on velocities meet the end") {
  for (const char* name : {"end_of_adjoint_1", "end_of_adjoint_2", "end_of_adjoint_3"})
    check_against_baumgarte(name, 1e-8);
}

TEST_CASE("index 2 on IDAS: no iteration of Newton's is taken unseen while a body turns on") {
  // A heavy top: where first iterations were judged by the rate of new factors |e|^2 - 1 came to some twenty
  // tolerances, and the error test paid for it with 8097 steps at 1e-6 and 13800 at 1e-8 (now 1662 and 3578). psi
  // against Baumgarte's ODE by dop853 at rtol 1e-12.
  constexpr double kPsi = 0.775877373900;
  for (const auto& [rtol, most] : {std::pair{1e-6, 2500}, {1e-8, 5000}}) {
    CAPTURE(rtol);
    Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/heavy_top/heavy_top.toml"));
    p.formulation = "index2";
    p.solver.integrator = "idas";
    p.solver.rtol = rtol;
    const Simulation r = simulate(p, p.parameters.values());
    CHECK(r.counters.steps < most);
    CHECK(std::abs(r.psi - kPsi) < 5e-2 * static_cast<double>(r.counters.steps) * rtol * kPsi);
  }
}

TEST_CASE("IDAS: a mass that swings on a stiff spring takes steps of its swing, not of the spring") {
  // What first iterations left unseen failed one error test after another, and what passed was off: over these
  // tolerances a median of 58,900 steps and of 109 rtol by index1 (34,024 and 145 by index2), now of 264 and 0.6 (233
  // and 0.4). Medians: an IDAS that falls to order 1 may still stay there. psi against radau5 at rtol 1e-12.
  Problem p =
      make_problem(Scene::parse("[gravity]\ny_m_per_s2 = -9.81\n"
                                "[point.A]\nx_m = 0\ny_m = 0\nground = true\n"
                                "[point.P]\nx_m = 1\ny_m = 0\n[mass.P]\npoint = \"P\"\nmass_kg = 1\n"
                                "[spring.S]\nfrom = \"A\"\nto = \"P\"\nstiffness_N_per_m = 1e8\n"
                                "natural_length_m = 1\ndamping_N_s_per_m = 2e4\n"
                                "[[cost.running]]\nkind = \"square\"\noutput = \"P.x\"\n"
                                "[run]\nt_end_s = 1\n",
                                "stiff.toml"));
  p.formulation = "baumgarte";
  p.solver.integrator = "radau5";
  p.solver.rtol = 1e-12;
  const double psi = simulate(p, p.parameters.values()).psi;
  p.solver.integrator = "idas";
  for (const char* formulation : {"index1", "index2"}) {
    CAPTURE(formulation);
    p.formulation = formulation;
    std::vector<double> steps, errors;
    for (int i = 0; i <= 10; ++i) {
      p.solver.rtol = std::pow(10, -6 - 0.2 * i);
      const Simulation r = simulate(p, p.parameters.values());
      steps.push_back(static_cast<double>(r.counters.steps));
      errors.push_back(std::abs(r.psi - psi) / (p.solver.rtol * psi));
    }
    std::nth_element(steps.begin(), steps.begin() + 5, steps.end());
    std::nth_element(errors.begin(), errors.begin() + 5, errors.end());
    CHECK(steps[5] < 600);
    CHECK(errors[5] < 5);
  }
}
