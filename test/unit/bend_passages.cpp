// Places at which a running cost bends, and when a motion passes them.
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "costate/event/bend_record.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

using namespace costate;

namespace {
const char* const kPlaces = R"toml([point.P]
x_m = 0
y_m = 0
[mass.m]
point = "P"
mass_kg = 1
[output.o]
formula = "abs(P.x - 0.3) + abs(P.x - 0.26) + abs(P.x - 0.9)"
unit = "m"
[[cost.running]]
kind = "value"
output = "o"
[start]
given = ["P.x", "P.y"]
)toml";

/// x(t), without anything else.
class Along {
 public:
  template <class X>
  explicit Along(const X& x)
      : at_([this, x](double t) {
          q_ = {x(t), 0};
          StateView s;
          s.t = t;
          s.q = q_.data();
          s.v = v_.data();
          return s;
        }) {}
  const GapTrace::States& at() const { return at_; }

 private:
  std::vector<double> q_, v_ = {0, 0};
  GapTrace::States at_;
};

void check_times(const std::vector<double>& found, const std::vector<double>& right) {
  REQUIRE(found.size() == right.size());
  for (std::size_t k = 0; k < found.size(); ++k) CHECK(found[k] == Approx(right[k]).margin(1e-8));
}
}  // namespace

TEST_CASE("bend passages: all of a step, in order of time, whichever place comes first in the formula") {
  const Problem p = make_problem(Scene::parse(kPlaces, "places.toml"));
  Assembly assembly(p.mechanism, p.parameters);
  BendWatch watch(assembly, p.objective, 1e-8, 1e-10, false);
  const Along forward([](double t) { return t; });
  std::vector<double> times;
  watch.each_passage(0, 1, forward.at(), [&](const BendWatch::Passage& at) {
    times.push_back(at.t);
    CHECK(at.beyond);
  });
  check_times(times, {0.26, 0.3, 0.9});
  // 0.26 and 0.3 lie in one quarter of the step, and the second of them is the formula's first.
  CHECK(watch.first(0, 1, forward.at()).value() == Approx(0.3));
}

TEST_CASE("bend passages: a step that is taken anew is recorded once, and one that goes back both ways") {
  const Problem p = make_problem(Scene::parse(kPlaces, "places.toml"));
  Assembly assembly(p.mechanism, p.parameters);
  BendRecord record(assembly, p.objective, 1e-8, 1e-10);
  CHECK_FALSE(record.empty());
  const Along forward([](double t) { return t; });
  record.add_step(0, 0.28, forward.at());
  record.add_step(0.28, 1, forward.at());
  record.add_step(0.28, 0.5, forward.at());  // shorter
  check_times(record.passages(), {0.26, 0.3});
  // From 0.5 it comes back to 0.28 and goes on.
  const Along back([](double t) { return 0.28 + 4 * (t - 0.735) * (t - 0.735); });
  record.add_step(0.5, 1, back.at());
  const double half = std::sqrt(0.02 / 4);
  check_times(record.passages(), {0.26, 0.3, 0.735 - half, 0.735 + half});
}
