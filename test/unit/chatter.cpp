// Runs that go from event to event and get on by next to nothing.
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "costate/base/error.h"
#include "costate/integrator/chatter_watch.h"

using namespace costate;
using Catch::Contains;

namespace {
/// After how many events that follow each other by `next(k)` a run to `end` is ended; 0 where it is not.
template <class Next>
int ended_after(int events, double end, const Next& next) {
  ChatterWatch watch;
  std::vector<RunEvent> met;
  double t = 0.5;
  for (int k = 0; k < events; ++k) {
    t += next(k);
    met.push_back({t, k % 2 == 0 ? "contact.a: touch" : "contact.a: release", k % 2 == 0 ? "closed" : "open"});
    try {
      watch.look(met, end);
    } catch (const SolverError& e) {
      CHECK_THAT(e.what(), Contains("does not get beyond t = 0.5") && Contains("'contact.a: touch closed'") &&
                               Contains("'contact.a: release open'"));
      return k + 1;
    }
  }
  return 0;
}
}  // namespace

TEST_CASE("chatter: a contact that touches and leaves evenly, by next to nothing, ends the run") {
  const auto in_turn = [](int k) { return k % 2 == 0 ? 4e-9 : 4.3e-9; };
  CHECK(ended_after(2000, 1, in_turn) == 401);
  // 4.5 ms of that would take a million events.
  CHECK(ended_after(2000, 0.5045, in_turn) == 0);
}

TEST_CASE("chatter: bounces that die out do not, however slowly, nor does what speeds up") {
  for (const double restitution : {0.5, 0.99, 0.999})
    CHECK(ended_after(20000, 1e4, [&](int k) { return 0.1 * std::pow(restitution, k); }) == 0);
  CHECK(ended_after(5000, 1e4, [](int k) { return 1e-9 * std::pow(1.001, k); }) == 0);
}
