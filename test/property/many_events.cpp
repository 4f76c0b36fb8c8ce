// Ten thousand events in one run: its adjoint keeps to one budget of memory, however many pieces the motion has.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

constexpr int kBounces = 1000;
constexpr double kHeight = 0.1, kGravity = 9.81;

/// A ball that bounces for good, without loss, up to a quarter of the fall behind the last of its touches.
std::string bouncing(int bounces) {
  const double fall = std::sqrt(2 * kHeight / kGravity);
  return fmt::format(R"(
[gravity]
y_m_per_s2 = -{1}
[body.ball]
x_m = 0
y_m = {0}
mass_kg = 1
inertia_kg_m2 = 1
[point.C]
on = "ball"
x_m = 0
y_m = 0
[contact.floor]
kind = "rigid"
point = "C"
restitution = 1
closing_speed_m_per_s = 0
[start]
given = ["ball.x", "ball.y", "ball.angle"]
[run]
t_end_s = {2:.17g}
rtol = 1e-9
[[cost.running]]
kind = "value"
output = "ball.y"
[parameter.height]
number = "body.ball.y_m"
[parameter.gravity]
number = "gravity.y_m_per_s2"
)",
                     kHeight, kGravity, (2 * bounces - 1 + 0.25) * fall);
}

/// The integral of the height: first a fall, then whole bounces of 2/3 h each, then what is left from a touch on.
template <class T>
T integral(T h, T g, double t_end, int touches) {
  using std::sqrt;
  const T fall = sqrt(2.0 * h / g), bounces = fall + (touches - 1.0) * 2.0 * fall, left = t_end - bounces;
  return bounces * h * 2.0 / 3.0 + g * fall * left * left / 2.0 - g * left * left * left / 6.0;
}

struct Expected {
  double psi, by_height, by_gravity;  // by the ground's pull upwards, which is negative
};
Expected expected(double t_end, int touches) {
  using C = std::complex<double>;
  const double h = 1e-30;
  return {integral(kHeight, kGravity, t_end, touches), integral(C(kHeight, h), C(kGravity), t_end, touches).imag() / h,
          -integral(C(kHeight), C(kGravity, h), t_end, touches).imag() / h};
}

Problem bouncing_problem(int bounces, double rtol) {
  Problem p = make_problem(Scene::parse(bouncing(bounces), "bouncing.toml"), {"height", "gravity"});
  p.solver.rtol = rtol;
  p.solver.confirm = false;
  return p;
}

}  // namespace

// A touch that is off by rtol makes all later bounces longer or shorter: after n touches phases are off by n^2 rtol,
// and the gradient, which is the last bounce's above all, as well; psi holds that bounce once in n. Where the budget
// holds all pieces of the motion none is run again; a narrow one keeps two at a time and where the others begin.
TEST_CASE("ten thousand events in one budget of memory", "[events]") {
  const auto check = [](const Problem& p, const GradientResult& r, int touches) {
    const Expected e = expected(p.solver.t_end, touches);
    const double phase = p.solver.rtol * touches * touches;
    CHECK(std::abs(r.psi / e.psi - 1) <= 1e3 * p.solver.rtol + phase / touches);
    CHECK(std::abs(r.gradient[0] / e.by_height - 1) <= phase);
    CHECK(std::abs(r.gradient[1] / e.by_gravity - 1) <= phase);
  };
  Problem many = bouncing_problem(10000, 1e-11);
  many.formulation = "baumgarte";
  many.solver.memory_budget_MB = 0.5;
  const GradientResult all = gradient(many, "cvodes-adjoint", many.parameters.values());
  check(many, all, 10000);
  CHECK(all.counters.checkpoints >= 9999);
  for (const auto& [formulation, method] :
       {std::pair{"baumgarte", "cvodes-adjoint"}, {"index1", "idas-adjoint"}, {"maggi", "cvodes-adjoint"}}) {
    CAPTURE(formulation, method);
    Problem p = bouncing_problem(300, 1e-9);
    p.formulation = formulation;
    const GradientResult wide = gradient(p, method, p.parameters.values());
    p.solver.memory_budget_MB = 0.5;
    const GradientResult narrow = gradient(p, method, p.parameters.values());
    check(p, wide, 300);
    check(p, narrow, 300);
    CHECK(wide.counters.checkpoints == 0);
    CHECK(narrow.counters.checkpoints >= 299);
    CHECK(narrow.psi == wide.psi);
    for (std::size_t j = 0; j < 2; ++j)
      CHECK(std::abs(narrow.gradient[j] - wide.gradient[j]) <= 1e-7 * std::abs(wide.gradient[j]));
  }
}
