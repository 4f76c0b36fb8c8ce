// Forces that dip through a bend for a moment: their derivative is a pulse there, over which the way back must not
// step.
//   x'' = -x + |sin 5 t - c|,   x(0) = 1,   psi = the integral of x^2
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {
constexpr double kPlace = 0.9999, kEnd = 6, kRate = 5;

const char* const kScene = R"toml([point.P]
x_m = 1
y_m = 0
[mass.m]
point = "P"
mass_kg = 1
[force.f]
point = "P"
formula_x_N = "-P.x + abs(sin(5*t) - c)"
formula_y_N = "0"
c = 0.9999
[start]
given = ["P.x", "P.y"]
[output.square]
formula = "P.x^2"
unit = "m^2"
[[cost.running]]
kind = "value"
output = "square"
[parameter.c]
number = "force.f.c"
[run]
t_end_s = 6
parameters = ["c"]
)toml";

/// d psi/d c: between two bends both x and its derivative are sines and a constant.
double slope() {
  std::vector<double> ends;
  const double first = std::asin(kPlace), half = std::acos(-1.0);
  for (int k = 0; k < 8; ++k)
    for (const double turn : {first, half - first})
      if (const double t = (turn + 2 * half * k) / kRate; t < kEnd) ends.push_back(t);
  ends.push_back(kEnd);
  double from = 0, side = -1, x = 1, v = 0, w = 0, wv = 0, sum = 0;  // w: by c
  for (const double to : ends) {
    // x = A cos + B sin + side (sin 5 t/(1 - 25) - c), w likewise
    const double p = side / (1 - kRate * kRate), a = x - p * std::sin(kRate * from) + side * kPlace,
                 b = v - p * kRate * std::cos(kRate * from), aw = w + side;
    const auto x_at = [&](double t) {
      return a * std::cos(t - from) + b * std::sin(t - from) + p * std::sin(kRate * t) - side * kPlace;
    };
    const auto w_at = [&](double t) { return aw * std::cos(t - from) + wv * std::sin(t - from) - side; };
    constexpr int kParts = 4000;  // Simpson's rule
    const double h = (to - from) / kParts;
    for (int i = 0; i <= kParts; ++i) {
      const double t = from + i * h, weight = i == 0 || i == kParts ? 1 : i % 2 == 1 ? 4 : 2;
      sum += weight * h / 3 * 2 * x_at(t) * w_at(t);
    }
    const double c = std::cos(to - from), s = std::sin(to - from), x1 = x_at(to), w1 = w_at(to);
    v = -a * s + b * c + p * kRate * std::cos(kRate * to);
    wv = -aw * s + wv * c;
    x = x1;
    w = w1;
    from = to;
    side = -side;
  }
  return sum;
}
}  // namespace

TEST_CASE("bends on the way back: pulses of a force's derivative are met") {
  const double exact = slope();
  CHECK(exact == Approx(12.4478598).epsilon(1e-8));  // dop853 with its discrete adjoint at rtol 1e-11
  for (const char* method : {"cvodes-adjoint", "idas-adjoint"})
    for (const char* formulation : {"baumgarte", "index1"})
      for (const double rtol : {1e-6, 1e-7, 1e-8}) {
        CAPTURE(method, formulation, rtol);
        Problem p = make_problem(Scene::parse(kScene, "pulses.toml"));
        p.formulation = formulation;
        p.solver.set_rtol(rtol);
        // Ten bends, each with a step or two at the beginning of what follows, of the tolerance each.
        CHECK(gradient(p, method, p.parameters.values()).gradient[0] == Approx(exact).epsilon(100 * rtol));
      }
}
