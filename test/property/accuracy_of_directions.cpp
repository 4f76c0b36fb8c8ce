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
  // And when it slips and stops is known to what two runs tell, of times by a run at 1e-12.
  const std::vector<double> times = {0.21230032, 1.18104273, 1.32207172};
  REQUIRE(run.times_error);
  REQUIRE(run.result.events.size() == times.size());
  for (std::size_t i = 0; i < times.size(); ++i)
    CHECK(std::abs(run.result.events[i].t - times[i]) <= 3 * *run.times_error);
  take_notices();
}
