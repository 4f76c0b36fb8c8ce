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
        p.solver.atol = 0;  // that of rtol
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
