// Running costs that are narrow pulses, and far below what absolute tolerances are made for.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"
#include "costate/hessian/hessian_products.h"
#include "costate/integrator/simulate.h"
#include "costate/optimize/certificate.h"
#include "costate/optimize/optimizer.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/error_estimate.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;

// A pulse exp(-((t - t0)/w)^2) in the cost, of area A w sqrt(pi) far below what atol makes of psi: steps met it, and no
// error test looked at it, so that every run was off by the same 3 to 26 percent, and said 1e-3 of that.
TEST_CASE("psi of a narrow pulse far below absolute tolerances", "[confirmation]") {
  struct Pulse {
    double A, w, rtol;
  };
  for (const Pulse& pulse : {Pulse{1e-8, 1e-3, 1e-8}, {1, 1e-7, 1e-5}, {1e-4, 2e-5, 1e-5}, {1e-6, 1e-3, 1e-7}})
    for (const char* method : {"idas-adjoint", "idas-forward", "cvodes-adjoint", "hand-adjoint"}) {
      const Problem p = make_problem(Scene::parse(fmt::format(R"toml(
[point.P]
x_m = 0
y_m = 0
vx_m_per_s = 1
[mass.m]
point = "P"
mass_kg = 1
[force.f]
point = "P"
formula_x_N = "-P.x"
formula_y_N = "-P.y"
[output.s]
formula = "A*exp(-((t-1.2345)/w)^2)"
unit = "1"
A = {}
w = {}
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 5
rtol = {}
parameters = ["A"]
[parameter.A]
number = "output.s.A"
[[cost.running]]
kind = "value"
output = "s"
)toml",
                                                              pulse.A, pulse.w, pulse.rtol),
                                                  "pulse.toml"));
      CAPTURE(pulse.A, pulse.w, pulse.rtol, method);
      const double area = pulse.w * std::sqrt(std::acos(-1.0)), right = pulse.A * area,
                   within = std::min(0.1, 1e4 * pulse.rtol);
      const GradientResult r = gradient(p, method, p.parameters.values());
      take_notices();
      CHECK(std::abs(r.psi - right) <= within * right);
      CHECK(std::abs(r.gradient[0] - area) <= within * area);
    }
}

namespace {

// Of test/cases/pulse_seen.toml: the place of an oscillator, x = sin(w t)/w with w = sqrt(k), seen through such a
// pulse.
constexpr double kTime = 1.2345, kWidth = 1e-3, kAmount = 1e-8;

}  // namespace

// 1e-8 (1 + (x(t0) - 1/2)^2) is least where sin(w t0) = w/2, and psi is the pulse's area there, but for what x' and x''
// make of its width. An optimization's evaluations were not confirmed, and ended at k = 1.89 with a third of psi.
TEST_CASE("an optimization of a narrow pulse far below absolute tolerances", "[optimize]") {
  const Problem p = problem_of_case("pulse_seen");
  double low = 1.5, high = 2;  // of w, by bisection
  for (int i = 0; i < 60; ++i) {
    const double w = 0.5 * (low + high);
    (std::sin(w * kTime) / w > 0.5 ? low : high) = w;
  }
  for (const char* method : {"idas-adjoint", "cvodes-forward"}) {
    CAPTURE(method);
    const OptimizerResult r = optimize(p, method, {}, {}, {}, {});
    const OptimizerEvaluation& best = r.evaluations[r.best];
    // Steps resolve psi to 1e4 rtol, and k to the root of that, over the second derivative.
    CHECK(std::abs(best.rho[0] - low * low) <= 2e-2 * low * low);
    const double area = kAmount * kWidth * std::sqrt(std::acos(-1.0));
    CHECK(std::abs(best.psi - area) <= 1e-4 * area);
    REQUIRE(best.tolerances.size() == 1);
    CHECK(best.tolerances[0].cost_atol < 1e-3);
    CHECK(certify(p, {}, r.evaluations.front(), best, method).kind == Certificate::Kind::strict_minimum);
    take_notices();
  }
}

// One run, and what tighter ones tell of its error: all had the same, and told a seventh of it.
TEST_CASE("the estimated error of a narrow pulse far below absolute tolerances", "[confirmation]") {
  Problem p = problem_of_case("pulse_seen");
  p.solver.confirm = false;
  const double w = std::sqrt(1.3), x = std::sin(w * kTime) / w,
               exact = kAmount * kWidth * std::sqrt(std::acos(-1.0)) * (1 + (x - 0.5) * (x - 0.5));
  for (const char* method : {"idas-adjoint", "cvodes-adjoint"}) {
    CAPTURE(method);
    const GradientResult r = gradient(p, method, p.parameters.values());
    const double error = std::abs(r.psi - exact), told = estimate_error(p, method, p.parameters.values(), r).psi;
    CHECK(error > 1e-4 * exact);  // or there is nothing to tell
    CHECK(told > 0.5 * error);
    CHECK(told < 2 * error);
  }
  const Simulation s = simulate(p, p.parameters.values());
  const double error = std::abs(s.psi - exact), told = estimate_error(p, p.parameters.values(), s).psi;
  CHECK(told > 0.5 * error);
  CHECK(told < 2 * error);
  take_notices();
}

// The way back looked for the adjoint's size at fifty times, none of them in the pulse, and its tolerances were those
// of an adjoint of size 1: 1.7 % off, said 1e-6.
TEST_CASE("second derivatives of a narrow pulse far below absolute tolerances", "[hessian]") {
  Problem p = problem_of_case("pulse_seen");
  const double k = 1.3, w = std::sqrt(k), by_k = 0.5 / w, by_kk = -0.25 / (w * w * w);
  // psi'' = A int (2 x_k^2 + 2 (x - 1/2) x_kk) exp(-((t - t0)/width)^2) dt, by the trapezoidal rule, which is exact to
  // rounding here.
  double exact = 0;
  for (int i = -700; i <= 700; ++i) {
    const double step = 0.01 * kWidth, t = kTime + i * step, s = std::sin(w * t), c = std::cos(w * t), x = s / w,
                 x_w = t * c / w - s / (w * w), x_ww = -t * t * s / w - 2 * t * c / (w * w) + 2 * s / (w * w * w),
                 x_k = x_w * by_k, x_kk = x_ww * by_k * by_k + x_w * by_kk;
    exact += kAmount * step * std::exp(-std::pow(0.01 * i, 2)) * (2 * x_k * x_k + 2 * (x - 0.5) * x_kk);
  }
  for (const Formulation& f : formulations()) {
    if (!f.make_hessian) continue;
    CAPTURE(f.name);
    p.formulation = f.name;
    const HessianProducts r = hessian_products(p, p.parameters.values(), Eigen::MatrixXd::Ones(1, 1));
    CHECK(std::abs(r.products(0, 0) - exact) <= 1e4 * p.solver.rtol * std::abs(exact));
    take_notices();
  }
}
