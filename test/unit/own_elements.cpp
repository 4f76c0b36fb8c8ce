// Elements and problems of one's own, which no reader of scenes has looked at: what is wrong in them is told, at the
// element, and not carried into a motion.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <memory>

#include "costate/base/error.h"
#include "costate/element/element.h"
#include "costate/integrator/simulate.h"
#include "costate/kind/body/mass.h"
#include "costate/kind/body/point.h"
#include "costate/mechanism/builder.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Contains;

namespace {

/// x^2/2 - k + (t/10)^2: a rod whose length changes with time, which it says or not.
class TimedRow final : public ConstraintOf<TimedRow> {
 public:
  TimedRow(int coordinate, int number, bool says) : ConstraintOf("rod", "timed"), says_(says) {
    append_coordinates({coordinate});
    append_numbers({number});
  }
  int rows() const override { return 1; }
  std::string row_name(int) const override { return "length"; }
  bool rheonomic() const override { return says_; }
  template <class S>
  void physics(const S& t, const S* q, const S* p, S* phi) const {
    phi[0] = q[0] * q[0] * S(0.5) - p[0] + t * t * S(0.01);
  }

 private:
  bool says_;
};

class Pull final : public ForceOf<Pull> {
 public:
  Pull(std::vector<int> coordinates, std::vector<int> numbers, int initial = -1)
      : ForceOf("pull", "own"), initial_(initial) {
    append_coordinates(coordinates);
    append_numbers(numbers);
  }
  int states() const override { return initial_ < 0 ? 0 : 1; }
  int initial_state_number(int) const override { return initial_; }
  template <class S>
  void physics(const S&, const S* q, const S*, const S*, const S* p, S* Q, S* zdot) const {
    Q[0] = -p[0] * q[0];
    if (states() > 0) zdot[0] = S(0.0);
  }

 private:
  int initial_;
};

struct OwnScene {
  MechanismBuilder builder;
  int x, k;
  OwnScene() {
    add_free_point(builder, "P", {1, 0, 0, 0});
    add_mass(builder, "m", "P", 2);
    x = builder.coordinate("P.x");
    k = builder.add_number("k", 10);
  }
};

}  // namespace

TEST_CASE("own elements: a constraint that changes with time and does not say so") {
  OwnScene s;
  CHECK_THROWS_WITH(s.builder.add(std::make_unique<TimedRow>(s.x, s.k, false)),
                    Contains("rod.timed") && Contains("'length'") && Contains("rheonomic"));
  CHECK_NOTHROW(s.builder.add(std::make_unique<TimedRow>(s.x, s.k, true)));
}

TEST_CASE("own elements: what the mechanism does not have") {
  OwnScene s;
  using Ints = std::vector<int>;
  CHECK_THROWS_WITH(s.builder.add(std::make_unique<Pull>(Ints{99}, Ints{s.k})),
                    Contains("pull.own") && Contains("coordinate of index 99"));
  CHECK_THROWS_WITH(s.builder.add(std::make_unique<Pull>(Ints{-1}, Ints{s.k})), Contains("coordinate of index -1"));
  CHECK_THROWS_WITH(s.builder.add(std::make_unique<Pull>(Ints{s.x}, Ints{999})), Contains("number of index 999"));
  CHECK_THROWS_WITH(s.builder.add(std::make_unique<Pull>(Ints{s.x}, Ints{s.k}, 7)), Contains("its number 7"));
  CHECK_THROWS_WITH(s.builder.add(std::unique_ptr<Force>()), Contains("null"));
  CHECK_THROWS_WITH(s.builder.add_parameter({"p", {{999, 1.0}}}), Contains("no number of index 999"));
  CHECK_THROWS_WITH(s.builder.add_parameter({"p", {{s.k, 1.0}, {s.k, 1.0}}}), Contains("'k' is listed twice"));
  CHECK_THROWS_WITH(s.builder.add_parameter({"p", {{s.k, 1.0}}, 20}), Contains("found 20"));
  CHECK_NOTHROW(s.builder.add_parameter({"p", {{s.k, 1.0}}, 10}));
  s.builder.build();
  CHECK_THROWS_WITH(s.builder.build(), Contains("builder is done"));
  CHECK_THROWS_WITH(s.builder.add_number("j", 1), Contains("builder is done"));
}

TEST_CASE("own problems: options that cannot be") {
  OwnScene s;
  s.builder.add(std::make_unique<Pull>(std::vector<int>{s.x}, std::vector<int>{s.k}));
  Problem good;
  good.mechanism = s.builder.build();
  good.parameters = good.mechanism->select({"k"});
  const auto wrong = [&](const std::function<void(Problem&)>& change, const char* what) {
    Problem p = good;
    change(p);
    CHECK_THROWS_WITH(gradient(p, "idas-adjoint", {10.0}), Contains(what));
    CHECK_THROWS_WITH(simulate(p, {10.0}), Contains(what));
  };
  CHECK_NOTHROW(simulate(good, {10.0}));
  const double none = std::nan("");
  wrong([&](Problem& p) { p.solver.t_end = none; }, "t_end");
  wrong([&](Problem& p) { p.solver.t_end = -1; }, "t_end");
  wrong([&](Problem& p) { p.solver.rtol = none; }, "rtol");
  wrong([&](Problem& p) { p.solver.rtol = 0; }, "rtol");
  wrong([&](Problem& p) { p.solver.atol = none; }, "atol");
  wrong([&](Problem& p) { p.solver.max_step_s = -1; }, "max_step_s");
  wrong([&](Problem& p) { p.solver.checkpoint_steps = -3; }, "checkpoint_steps");
  wrong([&](Problem& p) { p.objective.running.push_back(nullptr); }, "null");
  wrong([&](Problem& p) { p.mechanism.reset(); }, "no mechanism");
}
