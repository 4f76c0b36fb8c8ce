// Certificates at bounds: of a parameter that an optimizer left a hair inside its bound, and of one whose bound is what
// ends a long way down a shallow valley.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "costate/optimize/certificate.h"
#include "costate/optimize/certificate_verdict.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Matchers::Contains;
using Kind = Certificate::Kind;

namespace {

/// psi is a formula of where a point rests, which the parameters are.
Problem resting(const std::string& formula, double x, double y, const std::string& bounds) {
  return make_problem(Scene::parse(fmt::format(R"([point.P]
x_m = {}
y_m = {}
[mass.P]
point = "P"
mass_kg = 1
[output.hills]
formula = "{}"
unit = "1"
x = "P.x"
y = "P.y"
[[cost.terminal]]
kind = "value"
output = "hills"
[start]
given = ["P.x", "P.y"]
[parameter.X]
number = "point.P.x_m"
scale = 1
{}
[parameter.Y]
number = "point.P.y_m"
scale = 1
[run]
t_end_s = 0.1
rtol = 1e-8
formulation = "baumgarte"
parameters = ["X", "Y"]
)",
                                               x, y, formula, bounds),
                                   "hills.toml"));
}

Certificate certificate_of(const Problem& p, const Problem& first) {
  const auto evaluate = [](const Problem& of) {
    OptimizerEvaluation e;
    e.index = 1;
    e.rho = of.parameters.values();
    const GradientResult r = gradient(of, "idas-adjoint", e.rho);
    e.psi = r.psi;
    e.gradient = r.gradient;
    return e;
  };
  return certify(p, {}, evaluate(first), evaluate(p), "idas-adjoint");
}

}  // namespace

// Along x = y psi falls by 0.4 (6 - 2x) a unit; across, it rises by 1e5 a unit squared, of which a ten-thousandth is
// more than that slope.
TEST_CASE("certificate bounds: one that ends a valley holds") {
  const double a = 1e5, b = 0.2;  // psi_xx across and along
  // At x = 1: dpsi/dy = -a (x - y) + b (x + y - 6) = 0.
  const double y = (a - b + 6 * b) / (a + b);
  const std::string formula = "5e4*(x - y)^2 + 0.1*(x + y - 6)^2";
  const Certificate c =
      certificate_of(resting(formula, 1, y, "upper = 1"), resting(formula, 0.9999, 1.0001, "upper = 1"));
  INFO(c.verdict);
  CHECK(c.kind == Kind::strict_minimum);
  CHECK(c.active == std::vector<std::string>{"X.upper"});
  REQUIRE(c.multipliers.size() == 1);
  CHECK(c.multipliers[0].second == Approx(-(a * (1 - y) + b * (1 + y - 6))).epsilon(1e-6));
  // Where the bottom of the valley lies at the bound it holds nothing, and psi has a minimum in both.
  const std::string bottom = "5e4*(x - y)^2 + 0.1*(x + y - 2)^2";
  const Certificate free =
      certificate_of(resting(bottom, 1, 1, "upper = 1"), resting(bottom, 0.9999, 1.0001, "upper = 1"));
  INFO(free.verdict);
  CHECK(free.active.empty());
  CHECK(free.eigenvalues.size() == 2);
}

// As far inside as SLSQP was seen to stop; and so far that more evaluations would move it.
TEST_CASE("certificate bounds: a hair inside") {
  const std::string formula = "-x + (y - 0.3)^2";
  for (const double inside : {0.0, 2.2e-8, 1e-3}) {
    CAPTURE(inside);
    const Certificate c =
        certificate_of(resting(formula, 1 - inside, 0.3, "upper = 1"), resting(formula, 0.5, 0, "upper = 1"));
    INFO(c.verdict);
    CHECK((c.kind == Kind::strict_minimum) == (inside < 1e-6));
    CHECK((c.kind == Kind::not_stationary) == (inside > 1e-6));
    CHECK((c.active == std::vector<std::string>{"X.upper"}) == (inside < 1e-6));
  }
}

// Slopes that push out of bounds everywhere need no curvature.
TEST_CASE("certificate bounds: without a Hessian, where nothing is free") {
  Certificate c;
  c.tolerance = 1;
  c.active = {"X.upper"};
  judge(c, false);
  CHECK(c.kind == Kind::strict_minimum);
  c.free = {"Y"};
  judge(c, false);
  CHECK(c.kind == Kind::stationary);
}
