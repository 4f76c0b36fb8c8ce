// --accuracy of outputs that are parts of 1: Euler parameters of a body that does not turn are rounding, whose range is
// no measure of anything.
#include <catch2/catch.hpp>

#include "costate/base/notice.h"
#include "costate/problem/scene_problem.h"
#include "costate/tradeoff/accurate_run.h"
#include "support/cases.h"

using namespace costate;

TEST_CASE("accuracy of directions: what does not turn asks for nothing", "[events]") {
  const Problem p = problem_of_case("box_pulled_across");
  AccuracyRequest request;
  request.accuracy = 1e-4;
  request.outputs = {"box.y", "box.e0", "box.e3"};
  const AccurateRun run = run_to_accuracy(p, p.parameters.values(), request);
  CHECK(run.met);
  // What box.y asks for, and not the tightest there is.
  CHECK(run.problem.solver.rtol > 1e-11);
  take_notices();
}
