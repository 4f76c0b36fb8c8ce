// Fixed steps over the bends of a formula: each within a step, and the scheme keeps its order.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

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
