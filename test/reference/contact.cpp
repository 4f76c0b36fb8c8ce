// Balls on a slope and on the level against closed forms: whether they roll or slide, and when they begin to roll. In
// the plane and in space, where the formulas are those of a ball (I = 2/5 m R^2).
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

using namespace costate;

namespace {

constexpr double kG = 9.81, kRadius = 0.1, kMass = 1.3, kStiffness = 1e7;

// A ball on a plane that rises by `angle`, at rest against it: the depth carries the weight's normal part.
std::string ball(bool space, double angle, double mu, double speed, const std::string& output, double t_end,
                 double transition) {
  const double depth = std::pow(kMass * kG * std::cos(angle) / kStiffness, 2.0 / 3.0), r = kRadius - depth;
  const char* up = space ? "z" : "y";
  const std::string body =
      space ? fmt::format(
                  "[rigid_body.ball]\nx_m = {}\ny_m = 0\nz_m = {}\nvx_m_per_s = {}\nmass_kg = {}\n"
                  "inertia_xx_kg_m2 = {}\ninertia_yy_kg_m2 = {}\ninertia_zz_kg_m2 = {}\n",
                  -std::sin(angle) * r, std::cos(angle) * r, speed, kMass, 0.4 * kMass * kRadius * kRadius,
                  0.4 * kMass * kRadius * kRadius, 0.4 * kMass * kRadius * kRadius)
            : fmt::format("[body.ball]\nx_m = {}\ny_m = {}\nvx_m_per_s = {}\nmass_kg = {}\ninertia_kg_m2 = {}\n",
                          -std::sin(angle) * r, std::cos(angle) * r, speed, kMass, 0.4 * kMass * kRadius * kRadius);
  return fmt::format(R"(
[gravity]
{}_m_per_s2 = {}

{}
[point.C]
on = "ball"
x_m = 0
y_m = 0
{}

[contact.floor]
point = "C"
law = "hunt-crossley"
stiffness_N_per_m_n = {}
restitution = 0.5
approach_speed_m_per_s = 0.1
radius_m = {}
ground_angle_rad = {}
friction = "coulomb"
friction_coefficient = {}
transition_velocity_m_per_s = {}

[start]
given = [{}]

[run]
t_end_s = {}
formulation = "baumgarte"
rtol = 1e-9

[[cost.terminal]]
kind = "value"
output = "{}"
)",
                     up, -kG, body, space ? "z_m = 0" : "", kStiffness, kRadius, angle, mu, transition,
                     space ? "\"ball\"" : "\"ball.x\", \"ball.y\", \"ball.angle\"", t_end, output);
}

double at_end(const std::string& text) {
  const Problem p = make_problem(Scene::parse(text, "ball.toml"));
  return simulate(p, p.parameters.values()).psi;
}

}  // namespace

// Down the slope, after 1 s: v = t 5/7 g sin b while mu >= 2/7 tan b, else t g (sin b - mu cos b). With the smoothed
// law the slip that carries the friction force is v_s atanh(2/7 tan b / mu): the ball is faster by that, to first
// order.
TEST_CASE("contact: a ball rolls or slides down a slope", "[contact]") {
  const double b = 0.3, v_s = 1e-4;
  for (const bool space : {false, true}) {
    CAPTURE(space);
    const double rolling = at_end(ball(space, -b, 0.4, 0, "ball.x_dot", 1, v_s));
    CHECK(std::abs(rolling - 5.0 / 7 * kG * std::sin(b) * std::cos(b)) <= 2 * v_s);
    const double sliding = at_end(ball(space, -b, 0.05, 0, "ball.x_dot", 1, v_s));
    CHECK(std::abs(sliding - kG * (std::sin(b) - 0.05 * std::cos(b)) * std::cos(b)) <= 2 * v_s);
  }
}

// Thrown without spin, v0 = 1 m/s: it slides until t* = 2 v0/(7 mu g) and then rolls with 5/7 v0. By the smoothed law
// mu N tanh(s/v_s) the slip obeys sinh(s/v_s) = sinh(v0/v_s) exp(-7/2 mu g t/v_s), so that at t* there is s = v_s
// asinh(1/2) left, and the speed is 2/7 of that above 5/7 v0: first order in v_s, with the factor 0.13749.
TEST_CASE("contact: a ball thrown without spin comes to roll", "[contact]") {
  const double mu = 0.2, rolls = 2 / (7 * mu * kG);
  for (const bool space : {false, true}) {
    CAPTURE(space);
    const double before = at_end(ball(space, 0, mu, 1, "ball.x_dot", 0.9 * rolls, 1e-4));
    CHECK(std::abs(before - (1 - mu * kG * 0.9 * rolls)) <= 1e-6);
    for (const double v_s : {1e-2, 1e-3}) {
      const double left = at_end(ball(space, 0, mu, 1, "ball.x_dot", rolls, v_s)) - 5.0 / 7;
      CHECK(std::abs(left / v_s - 2.0 / 7 * std::asinh(0.5)) <= 1e-3);
    }
    CHECK(std::abs(at_end(ball(space, 0, mu, 1, "ball.x_dot", 1.2 * rolls, 1e-3)) - 5.0 / 7) <= 1e-6);
  }
}
