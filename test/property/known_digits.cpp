// Random trusses on which a method was off by more than 1e-4 at rtol 1e-8 without a word. Their numbers are those of
// the standing adversary's own reference (test/adversary/truss_motion.cpp: dense matrices, Dormand and Prince with
// projection, gradients by differences of whole motions).
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

namespace {
struct Case {
  int number;
  const char *formulation, *method;
  int parameter;  // -1: psi
  double right;
};
const std::vector<Case> kCases = {
    // A speed of 1e-5 m/s is asked for, of points that could move by metres.
    {110073, "maggi", "cvodes-adjoint", -1, -1.00565896e-05},
    {110073, "penalty", "hand-tangent", -1, -1.00565896e-05},
    {110073, "maggi-implicit", "idas-forward", -1, -1.00565896e-05},
    // Errors that do not fall as the tolerance does.
    {111309, "index1", "hand-tangent", 1, -1.59138924},
    // Grids that were refined into noise.
    {200085, "index3", "hand-tangent", 0, -0.10736929},
    // Changes of 3e4 rtol were taken for what errors explain.
    {200582, "maggi", "cvodes-adjoint", 0, 0.00175884677},
    {201233, "index3", "idas-forward", 0, 1.34791562},
    // Steps of a high order over the kink of a damper.
    {202242, "baumgarte", "discrete-adjoint", 0, -0.115666729},
    // A change of 9,600 rtol, from an error of 14,000.
    {201813, "maggi", "hand-tangent", 0, 12.9288358},
    // A penalty's motion where there is none.
    {203262, "penalty", "discrete-tangent", -1, 0},
};
}  // namespace

TEST_CASE("known digits: what is off by more than 1e-4 at rtol 1e-8 says so") {
  for (const Case& c : kCases) {
    INFO(c.number << ", " << c.formulation << ", " << c.method);
    Problem p = make_problem(Scene::load(fmt::format("{}/test/cases/truss_{}.toml", COSTATE_SOURCE_DIR, c.number)));
    p.formulation = c.formulation;
    p.solver.confirm = true;
    take_notices();
    const GradientResult r = gradient(p, c.method, p.parameters.values());
    const std::size_t notices = take_notices().size();
    const double found = c.parameter < 0 ? r.psi : r.gradient[static_cast<std::size_t>(c.parameter)];
    CAPTURE(found, c.right, notices);
    CHECK((std::abs(found - c.right) <= 1e-4 * std::abs(c.right) || notices > 0));
  }
}

TEST_CASE("known digits: index 3's grids are not refined into the noise of its own velocities") {
  // 17,353 steps and 2.7e-4 off, where refinement went on beyond what the equations of index 3 carry; 1,753 and 4e-8
  // where it stops there. Without confirmation, which would find the better of two such runs.
  Problem p = make_problem(Scene::load(fmt::format("{}/test/cases/truss_200085.toml", COSTATE_SOURCE_DIR)));
  p.formulation = "index3";
  const GradientResult r = gradient(p, "hand-tangent", p.parameters.values());
  take_notices();
  CAPTURE(r.counters.steps, r.gradient[0]);
  CHECK(r.counters.steps < 5000);
  CHECK(std::abs(r.gradient[0] + 0.10736929) < 1e-4 * 0.10736929);
}
