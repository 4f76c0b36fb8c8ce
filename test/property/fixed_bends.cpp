// Fixed steps over the bends of a formula: each within a step, and the scheme keeps its order.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Matchers::Contains;

namespace {

constexpr double kStart = 0.5, kEnd = 3, kStiff = 120, kSoft = 20;

std::string scene(const std::string& force) {
  return R"(
[point.P]
x_m = 0.5
y_m = 0

[mass.P]
point = "P"
mass_kg = 1

[force.spring]
point = "P"
formula_x_N = ")" +
         force + R"("

[start]
given = ["P.x", "P.y"]

[run]
t_end_s = 3

[[cost.terminal]]
kind = "value"
output = "P.x"
)";
}

/// Where a mass of 1 kg is at kEnd that is let go at kStart from rest, drawn back by kStiff x for x > 0 and kSoft x for
/// x < 0: arcs of cosines.
double place() {
  const double pi = std::acos(-1.0), stiff = std::sqrt(kStiff), soft = std::sqrt(kSoft), half = pi / stiff;
  double t = std::fmod(kEnd + half / 2, half + pi / soft);  // from where x rises through zero
  const double speed = kStart * stiff;
  return t < half ? speed / stiff * std::sin(stiff * t) : -speed / soft * std::sin(soft * (t - half));
}

}  // namespace

// A cosine of frequency w is late by w^3 h^2/12 a second with the trapezoidal rule and its kin, by a place of at most
// 0.5 w that: 164 h^2 in three seconds of the stiffer side alone. A bend within a step adds |jump of F'| |v| h^2/8 to
// v: with the six there are here (120 - 20) 5.5/8 6/20^0.5 = 92 h^2 at most.
TEST_CASE("fixed steps: a formula's bends within steps leave the order", "[discrete]") {
  Problem p = make_problem(Scene::parse(scene("-100*max(0,P.x)-20*P.x"), "bend.toml"));
  p.solver.integrator = "fixed";
  p.formulation = "index3";
  for (const double h : {0.02, 0.01, 0.005, 0.0025}) {
    p.solver.step_s = h;
    CAPTURE(h);
    CHECK(std::abs(simulate(p, p.parameters.values()).psi - place()) < 256 * h * h);
  }
}

TEST_CASE("fixed steps: what acts within a step alone is refused", "[discrete]") {
  // A detent 2 mm wide, passed in 0.4 ms.
  Problem p = make_problem(Scene::parse(scene("-20*P.x+1e4*max(0,0.001-abs(P.x-0.1))*1e3"), "detent.toml"));
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  p.solver.step_s = 0.01;
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Contains("passes over a touch: force.spring acts from"));
}

namespace {
/// A mass on a rope that pulls beyond 0.7 m, in drag: it goes slack and taut ten times.
const char* rope = R"(
[gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.3
y_m = 0.2
vx_m_per_s = 1.5
[mass.P]
point = "P"
mass_kg = 0.4
[spring.rope]
from = "O"
to = "P"
natural_length_m = 0
spring_law = { kind = "piecewise", breaks = [0.7], coefficients = [[0], [900]], joins = "continued" }
[drag.d]
point = "P"
drag_coefficient = 0.9
area_m2 = 0.05
wind_x_m_per_s = 2
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 2.5
parameters = ["L", "m", "vx"]
[[cost.terminal]]
kind = "value"
output = "P.x"
[parameter.L]
number = "spring.rope.spring_law.breaks[0]"
[parameter.m]
number = "mass.P.mass_kg"
[parameter.vx]
number = "point.P.vx_m_per_s"
)";

Problem rope_problem(double rtol) {
  Problem p = make_problem(Scene::parse(rope, "rope.toml"));
  p.solver.rtol = rtol;
  return p;
}

std::vector<double> rope_gradient() {
  Problem p = rope_problem(1e-10);
  p.formulation = "baumgarte";
  return gradient(p, "idas-forward", p.parameters.values()).gradient;
}
}  // namespace

// A step over a bend is off by the first order of its length in its derivative: halves of the steps may be as far off
// as these, and what is stated is all of the difference and as much again for chance. It was a 255th of it.
TEST_CASE("fixed steps: gradients over a law's bends state what these make of them", "[discrete]") {
  const std::vector<double> exact = rope_gradient();
  for (const double rtol : {1e-5, 1e-6, 1e-7}) {
    Problem p = rope_problem(rtol);
    p.formulation = "index3";
    const GradientResult r = gradient(p, "discrete-adjoint", p.parameters.values());
    CHECK_FALSE(take_notices().empty());
    REQUIRE(r.known_error);
    for (std::size_t j = 0; j < exact.size(); ++j) {
      CAPTURE(rtol, j, r.gradient[j], exact[j], r.known_error->gradient[j]);
      CHECK(std::abs(r.gradient[j] - exact[j]) <= 3 * r.known_error->gradient[j]);
    }
  }
}

// Grids that are refined until the gradient stands still have points at bends: derivatives were 0.4 of themselves off.
// Ten pulls of 2,250 1/s^2 make some 1e4 of the motion's own errors.
TEST_CASE("hand-derived: index 3 over a law's bends", "[hand][bends]") {
  const std::vector<double> exact = rope_gradient();
  for (const char* method : {"hand-tangent", "hand-adjoint"})
    for (const double rtol : {1e-6, 1e-8}) {
      Problem p = rope_problem(rtol);
      p.formulation = "index3";
      p.solver.confirm = false;
      const GradientResult r = gradient(p, method, p.parameters.values());
      CHECK(take_notices().empty());
      for (std::size_t j = 0; j < exact.size(); ++j) {
        CAPTURE(method, rtol, j, r.gradient[j], exact[j]);
        CHECK(std::abs(r.gradient[j] - exact[j]) <= 1e4 * rtol * std::abs(exact[j]));
      }
    }
}
