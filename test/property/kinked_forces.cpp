// Forces with kinks, in second-order adjoints and in runs by schemes whose error estimates pass over them.
//
// Second-order adjoints hold time derivatives of blocks that jump where a force has a kink: they cross it by the jump
// of mu' and sigma' (lib/README.md (4.4)). Against Baumgarte's adjoint on CVODES, whose equations hold no such
// derivative.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"
#include "property/gradient_compare.h"
#include "support/paths.h"

using namespace costate;

TEST_CASE("second-order adjoints cross the kinks of forces") {
  // Tyres on roads of every kind, tyres of every model, one damper of two branches.
  for (const char* name : {"kinked_force_1", "kinked_force_2", "kinked_force_3"}) {
    Problem problem = make_problem(Scene::load(fmt::format("{}/test/cases/{}.toml", COSTATE_SOURCE_DIR, name)));
    const auto rho = problem.parameters.values();
    problem.formulation = "baumgarte";
    problem.solver.rtol = 1e-10;
    const GradientResult expected = gradient(problem, "cvodes-adjoint", rho);
    problem.solver.rtol = 1e-8;
    for (const char* formulation : {"penalty-second-order", "maggi-second-order"}) {
      INFO(name << " " << formulation);
      problem.formulation = formulation;
      const GradientResult r = gradient(problem, "hand-adjoint", rho);
      const auto mismatch = test::gradient_mismatch(r.gradient, expected.gradient, problem.parameters);
      INFO(mismatch.text);
      // A thousand times rtol; without the jumps these are off by 4e-3 to 5e-2.
      CHECK(mismatch.error < 1e-5);
    }
  }
}

TEST_CASE("second-order adjoints end on the side of a start's kink that they are on") {
  // At rest rounding decides which that is: of these times some came to one side, and were off by 0.2 to 2 % where they
  // ended on the other.
  for (const double t_end : {0.05, 0.2, 0.5, 0.8, 1.0, 1.2, 1.4, 1.6593705201047626}) {
    Problem problem = make_problem(Scene::load(fmt::format("{}/test/cases/damper_at_rest.toml", COSTATE_SOURCE_DIR)));
    const auto rho = problem.parameters.values();
    problem.solver.t_end = t_end;
    problem.formulation = "baumgarte";
    const double expected = gradient(problem, "cvodes-forward", rho).gradient[0];
    for (const char* formulation : {"penalty-second-order", "maggi-second-order"}) {
      INFO(formulation << " until " << t_end);
      problem.formulation = formulation;
      CHECK(gradient(problem, "hand-adjoint", rho).gradient[0] == Approx(expected).epsilon(1e-6));
    }
  }
}

// A foot that is lifted lets go of the ground while it still dents it: from there to its release the normal force is
// cut off, and what damped a thousand times a second is gone. mu' jumps by as much, so that it counts to what part of
// the run the time of the kink is known: where its sides were 4e-9 of the run apart, with a step between them, the
// derivative by the restitution was off by 2.1e-3 here, whatever rtol.
TEST_CASE("second-order adjoints: a foot that is lifted") {
  Problem problem = make_problem(Scene::parse(R"(
gravity.y_m_per_s2 = -10
point.foot = { x_m = 0, y_m = -0.002, vx_m_per_s = 0.5 }
mass.foot = { point = "foot", mass_kg = 1 }
[contact.foot]
point = "foot"
law = "flores"
stiffness_N_per_m_n = 1e5
restitution = 0.05
approach_speed_m_per_s = 0.03
friction = "coulomb"
friction_coefficient = 0.2
transition_velocity_m_per_s = 0.1
[force.lift]
point = "foot"
y_N = { kind = "sine", amplitude = 30, angular_frequency_rad_per_s = 5 }
[run]
t_end_s = 0.5
rtol = 1e-12
parameters = ["force.lift.y_N.amplitude", "contact.foot.restitution"]
[[cost.terminal]]
kind = "value"
output = "foot.x"
[[cost.terminal]]
kind = "value"
output = "foot.y"
)",
                                              "lifted_foot.toml"));
  const auto rho = problem.parameters.values();
  problem.formulation = "penalty";
  const GradientResult expected = gradient(problem, "cvodes-forward", rho);
  for (const char* formulation : {"penalty-second-order", "maggi-second-order"}) {
    INFO(formulation);
    problem.formulation = formulation;
    const GradientResult r = gradient(problem, "hand-adjoint", rho);
    CHECK(r.counters.jumps == 1);
    // 1e4 rtol, as elsewhere where methods differ (contact_events.cpp).
    for (std::size_t j = 0; j < 2; ++j) CHECK(r.gradient[j] == Approx(expected.gradient[j]).epsilon(1e-8));
  }
}

// The walker's hind foot, which its other foot's strike lifts, and after it the rest of a step: off by 3e-5 and 1.4e-3.
// The step makes up to 1e7 of errors (of the slope's 1e6, of the stiffness' ten times that, index1 by cvodes-forward).
TEST_CASE("second-order adjoints: a walker's hind foot lets go") {
  Problem problem = make_problem(Scene::load(COSTATE_MODELS_DIR "/walker/arc_feet.toml"), {"slope", "stiffness"});
  problem.solver.t_end = 2.6;
  problem.solver.rtol = 1e-12;
  const auto rho = problem.parameters.values();
  problem.formulation = "penalty";
  const GradientResult expected = gradient(problem, "cvodes-adjoint", rho);
  for (const char* formulation : {"penalty-second-order", "maggi-second-order"}) {
    INFO(formulation);
    problem.formulation = formulation;
    const GradientResult r = gradient(problem, "hand-adjoint", rho);
    CHECK(r.gradient[0] == Approx(expected.gradient[0]).epsilon(1e-6));
    CHECK(r.gradient[1] == Approx(expected.gradient[1]).epsilon(1e-5));
  }
}

// A mass on a spring and damper that press only, pushed up and down: psi by a program apart, split at each touch and
// release (DOP853 of scipy at 1e-13): 0.237514744047. Radau's error estimate passes over a bend of the force: runs
// without derivatives were off by 2e-7 at every tolerance from 1e-8 to 1e-11. Errors of this motion are some ten times
// rtol; 1e-11 is what psi is known to.
TEST_CASE("forces that bend: plain runs by implicit schemes") {
  Problem p = make_problem(Scene::load(COSTATE_SOURCE_DIR "/test/cases/pressed.toml"));
  for (const char* formulation : {"baumgarte", "index1", "maggi-implicit", "index2"})
    for (const char* scheme : {"radau3", "radau5", "radau9"})
      for (const double rtol : {1e-7, 1e-9, 1e-11}) {
        if (std::string(scheme) == "radau3" && rtol < 1e-8) continue;  // of order three: it takes 1e5 steps
        CAPTURE(formulation, scheme, rtol);
        p.formulation = formulation;
        p.solver.integrator = scheme;
        p.solver.set_rtol(rtol);
        CHECK(std::abs(simulate(p, p.parameters.values()).psi - 0.237514744047) <= 100 * rtol + 1e-11);
      }
}
