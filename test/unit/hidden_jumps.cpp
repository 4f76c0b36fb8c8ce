// Jumps and kinks of laws that tell nothing of them, by looking for them; and courses without any, steep and noisy ones
// among them.
#include "costate/element/law/hidden_jumps.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "costate/element/law/formula_law.h"

using namespace costate;

namespace {

std::vector<HiddenJump> found(const std::string& formula, JumpOf of, double from = 0, double to = 2) {
  return HiddenJumps(FormulaLaw(formula, {}), nullptr, from, to).of(of);
}

void check_one(const std::string& formula, JumpOf of, double x, double left, double right) {
  CAPTURE(formula);
  const auto jumps = found(formula, of);
  REQUIRE(jumps.size() == 1);
  CHECK(jumps[0].x == Approx(x).epsilon(1e-14));
  CHECK(jumps[0].left == Approx(left).margin(1e-12));
  CHECK(jumps[0].right == Approx(right).margin(1e-12));
}

}  // namespace

TEST_CASE("hidden jumps: values and slopes") {
  const double half = std::numbers::pi / 2;
  check_one("atan(tan(1.2*t))", JumpOf::value, half / 1.2, half, -half);
  check_one("atan(1/(t-1.0371))", JumpOf::value, 1.0371, -half, half);
  check_one("(t-0.7)/sqrt((t-0.7)^2)", JumpOf::value, 0.7, -1, 1);
  check_one("(t-1+sqrt((t-1)^2))/2", JumpOf::slope, 1, 0, 1);
  check_one("((t^2-1)^2)^0.5", JumpOf::slope, 1, -2, 2);
  check_one("sqrt(sin(2*t)^2)", JumpOf::slope, half, -2, 2);
  check_one("(t-1.3)*sqrt((t-1.3)^2)", JumpOf::curvature, 1.3, -2, 2);
  CHECK(found("atan(tan(10*t))", JumpOf::value).size() == 6);
  // What two neighbouring numbers do not tell apart is a jump; so is a step of which they show 1e-4.
  CHECK(found("tanh((t-1)/1e-12)", JumpOf::value).size() == 1);
}

TEST_CASE("hidden jumps: none of what is smooth") {
  for (const char* formula :
       {"0.3*sin(12*t)+t^2", "tanh((t-1)/1e-5)", "exp(-(t-1)^2/1e-6)", "sqrt((t-1)^2+1e-10)", "sin(t)/t",
        "1/(1+1e6*(t-1)^2)", "log(t+1e-3)", "(t+1e-9)^0.5", "1e-30*sin(t)", "atan((t-1)/1e-6)"})
    for (const JumpOf of : {JumpOf::value, JumpOf::slope, JumpOf::curvature}) {
      CAPTURE(formula, static_cast<int>(of));
      CHECK(found(formula, of).empty());
    }
  CHECK(found("(1-cos(t))/t^2", JumpOf::value).empty());  // 0 below 1e-8, then 1, as rounding has it
  CHECK(found("atan(tan(1.2*t))", JumpOf::value, 0, 1.3).empty());
  CHECK(found("atan(tan(1.2*t))", JumpOf::value, 0, 0).empty());
  // A law that knows its places is believed.
  const double p[] = {0.5, 1.5, 0, 1};
  CHECK(HiddenJumps(SmoothStepLaw(), p, 0, 2).of(JumpOf::slope).empty());
}
