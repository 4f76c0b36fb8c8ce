// What each model of friction leaves of a standstill, and what rolling and spinning resist, against closed forms.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/element/force/contact_laws.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

using namespace costate;

namespace {

constexpr double kG = 9.81, kMass = 1.3, kSlope = 0.2, kStiffness = 1e6;
constexpr double kSliding = 0.3, kSticking = 0.4, kTransition = 1e-6, kDead = 2e-7, kBristles = 1e4;

// A box on two corners, where it stands still but for what is left: the depth of each carries its share of the weight,
// N2 + N1 = m g cos b, (N2 - N1) w = F h with F = m g sin b.
std::string box(const std::string& friction, const std::string& numbers, const std::string& output, double t_end) {
  const double w = 0.2, h = 0.1, n = kMass * kG * std::cos(kSlope), f = kMass * kG * std::sin(kSlope);
  const double front = 0.5 * (n + f * h / w), rear = n - front;
  const double d1 = std::pow(rear / kStiffness, 2.0 / 3), d2 = std::pow(front / kStiffness, 2.0 / 3);
  // Downhill is +x: the ground falls, the box leans forward by (d2 - d1)/2w.
  const double up = h - 0.5 * (d1 + d2);
  return fmt::format(R"(
[gravity]
y_m_per_s2 = -9.81

[body.box]
x_m = {}
y_m = {}
angle_rad = {}
mass_kg = 1.3
inertia_kg_m2 = 0.02

[point.rear]
on = "box"
x_m = -0.2
y_m = -0.1

[point.front]
on = "box"
x_m = 0.2
y_m = -0.1

[contact.floor]
points = ["rear", "front"]
law = "hunt-crossley"
stiffness_N_per_m_n = 1e6
restitution = 0.5
approach_speed_m_per_s = 0.1
ground_angle_rad = -0.2
friction = "{}"
friction_coefficient = 0.3
{}

[start]
given = ["box.x", "box.y", "box.angle"]

[run]
t_end_s = {}
rtol = 1e-9

[[cost.terminal]]
kind = "value"
output = "{}"
)",
                     up * std::sin(kSlope), up * std::cos(kSlope), -kSlope - 0.5 * (d2 - d1) / w, friction, numbers,
                     t_end, output);
}

double at_end(const std::string& text) {
  const Problem p = make_problem(Scene::parse(text, "contact.toml"));
  return simulate(p, p.parameters.values()).psi;
}

/// v where m(v) = tan b, m rising.
template <class Coefficient>
double creep_of(const Coefficient& m) {
  double low = 0, high = kTransition;
  for (int k = 0; k < 200; ++k) {
    const double v = 0.5 * (low + high);
    (m(v) < std::tan(kSlope) ? low : high) = v;
  }
  return 0.5 * (low + high);
}

}  // namespace

// Below the angle of friction a box stays, but for the creep by which a smoothed law carries its weight: mu(v) = tan b.
// The laws with bristles do not creep: the box hangs on them, displaced by tan b/sigma,
// about which it still swings by less than that where only hysteresis damps it (Dahl). The formulas are written anew
// from their sources (contact_laws.h). 1000 s at 1e-6 m/s are a millimetre; the way of the first swing, 1e-4 m at most
// (tan b/sigma = 2e-5 m), is left out by taking the second half.
TEST_CASE("contact: a box stays on a slope for 1000 s, and what it creeps", "[contact]") {
  const auto tanh_of = [](double v) { return std::tanh(v / kTransition); };
  struct Case {
    const char *friction, *numbers;
    double creep;
  };
  const std::string transition = "transition_velocity_m_per_s = 1e-6\n", sticking = "static_coefficient = 0.4\n";
  const std::string two = transition + sticking, dead = transition + "dead_velocity_m_per_s = 2e-7\n",
                    bristles = "bristle_stiffness_per_m = 1e4\n",
                    lugre = bristles + "bristle_damping_s_per_m = 10\n" + two;
  const double t = std::tan(kSlope), r0 = t / kSliding;
  for (const Case& c : {
           Case{"coulomb", transition.c_str(), kTransition * std::atanh(r0)},
           Case{"threlfall", transition.c_str(), -kTransition / 3 * std::log(1 - r0 * (1 - std::exp(-3.0)))},
           Case{"ambrosio", dead.c_str(), kDead + (kTransition - kDead) * r0},
           Case{"bengisu-akay", two.c_str(), kTransition * (1 - std::sqrt(1 - t / kSticking))},
           Case{"stribeck", two.c_str(), creep_of([&](double v) {
                  const double x = v / kTransition;
                  return (kSliding + (kSticking - kSliding) * std::exp(-x * x)) * tanh_of(v);
                })},
           Case{"brown-mcphee", two.c_str(), creep_of([&](double v) {
                  const double x = v / kTransition;
                  return kSliding * std::tanh(4 * x) + (kSticking - kSliding) * x / std::pow(0.25 * x * x + 0.75, 2);
                })},
           Case{"dahl", bristles.c_str(), 0},
           Case{"lugre", lugre.c_str(), 0},
       }) {
    CAPTURE(c.friction, c.creep);
    const double half = at_end(box(c.friction, c.numbers, "box.x", 500));
    const double whole = at_end(box(c.friction, c.numbers, "box.x", 1000));
    const double creep = (whole - half) / (500 * std::cos(kSlope));
    if (c.creep > 0)
      CHECK(std::abs(creep - c.creep) <= 1e-3 * kTransition);
    else
      CHECK(std::abs(whole - 0.1 * std::sin(kSlope)) <= 2 * t / kBristles);
  }
}

// The depth of statics: both corners carry the weight (17.4) with the rate zero, d = (N/K)^(2/3).
TEST_CASE("contact: at rest the penetration is that of statics", "[contact]") {
  const double n = kMass * kG * std::cos(kSlope), f = kMass * kG * std::sin(kSlope);
  const double deepest = std::pow(0.5 * (n + f * 0.1 / 0.2) / kStiffness, 2.0 / 3);
  const std::string numbers = "transition_velocity_m_per_s = 1e-6";
  // The lean moves the lever arms by 1e-4 of themselves, which the tolerance holds.
  CHECK(std::abs(at_end(box("coulomb", numbers, "floor.penetration", 100)) / deepest - 1) <= 2e-4);
  CHECK(std::abs(at_end(box("coulomb", numbers, "floor.normal_force", 100)) / n - 1) <= 1e-7);
  // The forces of both corners have the moment that keeps the box from tipping: along the plane their centre lies below
  // the centre of mass, which is at 0 but for the creep and the depth: (h - d) tan b downhill.
  const double centre = at_end(box("coulomb", numbers, "floor.centre_of_pressure", 100));
  CHECK(std::abs(centre - 0.1 * std::tan(kSlope)) <= 2e-4);
}

namespace {

std::string ball(bool space, const std::string& numbers, const std::string& start, const std::string& output,
                 double t_end) {
  const double depth = std::pow(kMass * kG / kStiffness, 2.0 / 3), r = 0.1 - depth;
  const std::string body =
      space ? fmt::format(
                  "[rigid_body.ball]\nx_m = 0\ny_m = 0\nz_m = {}\nmass_kg = 1.3\ninertia_xx_kg_m2 = 0.0052\n"
                  "inertia_yy_kg_m2 = 0.0052\ninertia_zz_kg_m2 = 0.0052\n{}\n",
                  r, start)
            : fmt::format("[body.ball]\nx_m = 0\ny_m = {}\nmass_kg = 1.3\ninertia_kg_m2 = 0.0052\n{}\n", r, start);
  return fmt::format(R"(
[gravity]
{}_m_per_s2 = -9.81

{}
[point.C]
on = "ball"
x_m = 0
y_m = 0
{}

[contact.floor]
point = "C"
law = "hunt-crossley"
stiffness_N_per_m_n = 1e6
restitution = 0.5
approach_speed_m_per_s = 0.1
radius_m = 0.1
friction = "coulomb"
friction_coefficient = 0.5
transition_velocity_m_per_s = 1e-5
turning_transition_rad_per_s = 1e-4
{}

[start]
given = [{}]

[run]
t_end_s = {}
rtol = 1e-9

[[cost.terminal]]
kind = "value"
output = "{}"
)",
                     space ? "z" : "y", body, space ? "z_m = 0" : "", numbers,
                     space ? "\"ball\"" : "\"ball.x\", \"ball.y\", \"ball.angle\"", t_end, output);
}

}  // namespace

// A ball that rolls, with the moment c N against it: m a = -F and I a/R = F R - c N give a = -c g/(R (1 + 2/5)). What
// is left is the slip that carries F, below v_s. Spinning about the normal: I omega' = -c N.
TEST_CASE("contact: rolling and spinning resistance", "[contact]") {
  const double c = 0.002, a = c * kG / (0.1 * 1.4), t = 2;
  const std::string rolling = fmt::format("rolling_resistance_m = {}", c);
  const double plane =
      at_end(ball(false, rolling, "vx_m_per_s = 1\nangular_velocity_rad_per_s = -10", "ball.x_dot", t));
  CHECK(std::abs(plane - (1 - a * t)) <= 2e-5);
  const double space = at_end(ball(true, rolling, "vx_m_per_s = 1\nomega_global_y_rad_per_s = 10", "ball.x_dot", t));
  CHECK(std::abs(space - (1 - a * t)) <= 2e-5);
  // It comes to rest, and stays.
  CHECK(std::abs(at_end(ball(false, rolling, "vx_m_per_s = 0.1\nangular_velocity_rad_per_s = -1", "ball.x_dot", 2))) <=
        2e-5);
  const double spun =
      at_end(ball(true, "spinning_resistance_m = 0.001", "omega_global_z_rad_per_s = 5", "ball.omega_z", 1));
  CHECK(std::abs(spun - (5 - 0.001 * kMass * kG / 0.0052)) <= 1e-5);
}

// Hertz's stiffness between a sphere and a plane, 4/3 E* sqrt(R), by the depth of a ball at rest: (m g/K)^(2/3).
TEST_CASE("contact: stiffness of materials", "[contact]") {
  const auto scene = [](const std::string& ground) {
    return fmt::format(R"(
[gravity]
y_m_per_s2 = -9.81
[body.ball]
x_m = 0
y_m = 0.0999
mass_kg = 1.3
inertia_kg_m2 = 0.0052
[point.C]
on = "ball"
x_m = 0
y_m = 0
[contact.floor]
point = "C"
law = "flores"
youngs_modulus_Pa = 1e7
poisson_ratio = 0.45
{}
restitution = 0.1
radius_m = 0.1
approach_speed_m_per_s = 0.01
[start]
given = ["ball.x", "ball.y", "ball.angle"]
[run]
t_end_s = 20
[[cost.terminal]]
kind = "value"
output = "floor.penetration"
)",
                       ground);
  };
  const auto depth = [](double compliance) {
    return std::pow(kMass * kG / (4.0 / 3 / compliance * std::sqrt(0.1)), 2.0 / 3);
  };
  const double body = (1 - 0.45 * 0.45) / 1e7;
  CHECK(at_end(scene("")) == Approx(depth(body)).epsilon(1e-6));
  CHECK(at_end(scene("ground_youngs_modulus_Pa = 4e6\nground_poisson_ratio = 0.4")) ==
        Approx(depth(body + (1 - 0.16) / 4e6)).epsilon(1e-6));
}
