// Second-order adjoints hold time derivatives of blocks that jump where a force has a kink: they cross it by the jump
// of mu' and sigma' (lib/README.md (4.4)). Against Baumgarte's adjoint on CVODES, whose equations hold no such
// derivative.
#include <fmt/format.h>

#include <catch2/catch.hpp>

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
