// Motions that are even or given by drivers: their adjoints are constant, or polynomials of a low degree, with no error
// at any order, and what the gradient integrates along them needs a high one all the same.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

namespace {
struct Trivial {
  const char* scene;
  std::vector<double> gradient;
};
const std::vector<Trivial> kTrivial = {
    // A free body in even motion and under gravity: x + z at 1 s.
    {"throw3", {1, 0.5}},
    // Driven throughout: the integral of -0.9 + a sin(4 t + 0.1) over 0.3 s.
    {"driven_r", {(std::cos(0.1) - std::cos(1.3)) / 4}},
    // Driven but for one coordinate, which rests at 1.5: the integral of its square; gravity moves it by t^2 / 2.
    {"driven_but_one", {0, 0, 0.0135}},
};
}  // namespace

TEST_CASE("trivial motions: IDAS's backward runs find the order that the gradient needs", "[trivial]") {
  for (const Trivial& c : kTrivial)
    for (const char* formulation : {"index1", "baumgarte", "index2", "maggi-implicit"})
      for (int digits = 6; digits <= 12; digits += 2) {
        INFO(c.scene << ", " << formulation << ", 1e-" << digits);
        Problem p = make_problem(Scene::load(fmt::format("{}/test/cases/{}.toml", COSTATE_SOURCE_DIR, c.scene)));
        p.formulation = formulation;
        const double rtol = p.solver.rtol = std::pow(10.0, -digits);
        p.solver.atol = 0;         // that of rtol
        p.solver.confirm = false;  // the steps are those of rtol
        const GradientResult r = gradient(p, "idas-adjoint", p.parameters.values());
        CAPTURE(r.psi, r.gradient, r.counters.backward_steps);
        // Steps add up: by some tens of rtol of the component and of what a parameter's whole scale does to psi.
        for (std::size_t j = 0; j < c.gradient.size(); ++j)
          CHECK(std::abs(r.gradient[j] - c.gradient[j]) <=
                100 * rtol * std::max(std::abs(c.gradient[j]), std::abs(r.psi) / p.parameters.parameters[j].scale));
        // Some 20 to get to order 5, then about rtol^(-1/6) steps, 100 at 1e-12, several times that where rows are
        // stabilized; at order 1 rtol^(-1/2), 1e6.
        CHECK(static_cast<double>(r.counters.backward_steps) < 20 + 10 * std::pow(rtol, -1 / 6.0));
      }
}

// Forward, too: a plate that stands still under a target that moves, and a mechanism that is driven throughout, by a
// formulation that has no state of it: at order 1 these took rtol^(-1/2) steps and more, 4e5 at 1e-10. IDAS takes some
// 40 steps until it is seen, as many until the order is high again, then about rtol^(-1/6) times ten.
TEST_CASE("trivial motions: IDAS's forward runs find the order that psi needs", "[trivial]") {
  struct Case {
    const char *scene, *formulation;
    double psi, gradient;
  };
  const double c6 = std::cos(6.0), s12 = std::sin(12.0);
  const std::vector<Case> cases = {
      // The integral of (0.2 - 0.5 sin 3 t)^2 over 2 s, and its derivative with respect to 0.2.
      {"static", "index1", 0.08 - 0.2 * (1 - c6) / 3 + 0.25 * (1 - s12 / 12), 0.8 - (1 - c6) / 3},
      {"static", "maggi-implicit", 0.08 - 0.2 * (1 - c6) / 3 + 0.25 * (1 - s12 / 12), 0.8 - (1 - c6) / 3},
      {"driven_r", "maggi-implicit", -0.27 + 0.5 * (std::cos(0.1) - std::cos(1.3)) / 4,
       (std::cos(0.1) - std::cos(1.3)) / 4},
  };
  for (const Case& c : cases)
    for (const char* method : {"idas-forward", "idas-adjoint"})
      for (int digits = 6; digits <= 12; digits += 2) {
        INFO(c.scene << ", " << c.formulation << ", " << method << ", 1e-" << digits);
        Problem p = make_problem(Scene::load(fmt::format("{}/test/cases/{}.toml", COSTATE_SOURCE_DIR, c.scene)));
        p.formulation = c.formulation;
        const double rtol = p.solver.rtol = std::pow(10.0, -digits);
        p.solver.atol = 0;  // that of rtol
        const GradientResult r = gradient(p, method, p.parameters.values());
        CAPTURE(r.psi, r.gradient, r.counters.steps);
        // No step is off by more than the tolerance.
        const auto steps = static_cast<double>(r.counters.steps);
        CHECK(std::abs(r.psi - c.psi) <= steps * rtol * std::abs(c.psi));
        CHECK(std::abs(r.gradient[0] - c.gradient) <= steps * rtol * std::abs(c.gradient));
        CHECK(steps < 80 + 10 * std::pow(rtol, -1 / 6.0));
      }
}
