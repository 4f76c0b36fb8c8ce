// Contacts of small, light and fast bodies: a ball falls onto a rough plane, slides and rolls, in units of micrometres
// and nanometres, of microseconds and of picograms, against its closed form; and a pendulum whose tip lands, against
// itself in units of one. An angle counts at the mechanism's length there: rad/s^2 are not m/s^2.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

struct Units {
  double length, time, mass;
};
// The last two with gravity in proportion.
const Units kUnits[] = {{1, 1, 1},           {1e-3, 0.0316227766016838, 1},
                        {1e-6, 1e-3, 1},     {1e-9, 3.16227766016838e-5, 1},
                        {1e-6, 1e-3, 1e-15}, {1e-3, 1e-6, 1e-9}};
constexpr double kGravity = 9.81;

GradientResult run(const std::string& text, const std::vector<std::string>& parameters, const char* formulation,
                   const char* method) {
  Problem p = make_problem(Scene::parse(text, "small.toml"), parameters);
  p.formulation = formulation;
  return gradient(p, method, p.parameters.values());
}

/// On the plane, that a length of the contact in units has as well.
std::string contact(const Units& u, const char* point, const char* key, double length, double restitution,
                    double friction) {
  return fmt::format(R"toml([contact.C]
point = "{}"
{} = {}
kind = "rigid"
restitution = {}
closing_speed_m_per_s = {}
friction = "coulomb"
friction_coefficient = {}
)toml",
                     point, key, length * u.length, restitution, 0.05 * u.length / u.time, friction);
}

/// Radius 0.1, inertia 4e-3, height 0.2 and speed 1.5 in units.
std::string ball(const Units& u) {
  return fmt::format(R"toml([gravity]
y_m_per_s2 = {}
[body.b]
x_m = 0
y_m = {}
vx_m_per_s = {}
mass_kg = {}
inertia_kg_m2 = {}
[point.p]
on = "b"
x_m = 0
y_m = 0
{}[start]
given = ["b.x", "b.y", "b.angle"]
[run]
t_end_s = {}
[[cost.terminal]]
kind = "value"
output = "b.x"
)toml",
                     -kGravity * u.length / (u.time * u.time), 0.2 * u.length, 1.5 * u.length / u.time, u.mass,
                     4e-3 * u.mass * u.length * u.length, contact(u, "p", "radius_m", 0.1, 0, 0.15), 0.9 * u.time);
}

/// It lands at t with v_y = g t, and slides from v - mu v_y, until its speed is that of rolling, v/(1 + m R^2/I) k with
/// k = m R^2/I = 2.5.
long double distance(long double mu) {
  const long double g = kGravity, t = std::sqrt(0.2L / g), vy = g * t, k = 2.5L, v = 1.5L;
  const long double slides = (v / (mu * (1 + k)) - vy) / g, rolls = v * k / (1 + k);
  return v * t + (v - mu * vy) * slides - mu * g * slides * slides / 2 + rolls * (0.9L - t - slides);
}

/// Steps end at events and t_end, and rtol is 1e-8: what is left of it.
constexpr double kOfPsi = 1e-7, kOfGradient = 3e-6;

std::string pendulum(const Units& u) {
  const double force = u.mass * u.length / (u.time * u.time), torque = force * u.length;
  return fmt::format(R"toml([gravity]
y_m_per_s2 = {}
[point.O]
ground = true
x_m = 0
y_m = 0
[point.A]
x_m = {}
y_m = {}
[point.B]
x_m = {}
y_m = {}
[bar.a]
from = "O"
to = "A"
mass_kg = {}
[bar.b]
from = "A"
to = "B"
mass_kg = {}
[angle.q]
bar = "a"
[couple.c]
angle = "q"
formula = "-k*max(0, q.angle - c) - d*q.angle_dot"
k = {}
c = -0.5
d = {}
[force.f]
point = "B"
x_N = {}
[start]
given = ["A.x", "B.x"]
{}[run]
t_end_s = {}
[[cost.terminal]]
kind = "value"
output = "B.x"
)toml",
                     -kGravity * u.length / (u.time * u.time), 0.4 * u.length, 0.1 * u.length, 0.9 * u.length,
                     0.2 * u.length, 1.1 * u.mass, 0.8 * u.mass, 9 * torque, 0.2 * torque * u.time, 2 * force,
                     contact(u, "B", "ground_height_m", -0.45, 0.5, 0.3), 1.2 * u.time);
}

/// A ball in space that turns about two axes, bounces, slides and rolls.
std::string spinning_ball(const Units& u) {
  const double speed = u.length / u.time, inertia = 4e-3 * u.mass * u.length * u.length;
  return fmt::format(R"toml([gravity]
z_m_per_s2 = {}
[rigid_body.b]
x_m = 0
y_m = 0
z_m = {}
vx_m_per_s = {}
vy_m_per_s = {}
omega_z_rad_per_s = {}
omega_x_rad_per_s = {}
mass_kg = {}
inertia_xx_kg_m2 = {}
inertia_yy_kg_m2 = {}
inertia_zz_kg_m2 = {}
[point.p]
on = "b"
x_m = 0
y_m = 0
z_m = 0
{}[start]
given = ["b"]
[run]
t_end_s = {}
[[cost.terminal]]
kind = "value"
output = "b.x"
)toml",
                     -kGravity * u.length / (u.time * u.time), 0.2 * u.length, 1.5 * speed, 0.7 * speed, 3 / u.time,
                     2 / u.time, u.mass, inertia, inertia, inertia, contact(u, "p", "radius_m", 0.1, 0.3, 0.15),
                     0.9 * u.time);
}

/// A body that lands on one of two corners first, by a hundredth of a length.
std::string two_corners(const Units& u) {
  const auto corner = [&](const char* name, double x) {
    return fmt::format(
        "[point.{0}]\non = \"b\"\nx_m = {1}\ny_m = 0\n[contact.{0}]\npoint = \"{0}\"\nground_height_m = 0\nkind = "
        "\"rigid\"\nrestitution = 0.4\nclosing_speed_m_per_s = {2}\nfriction = \"none\"\n",
        name, x * u.length, 1e-3 * u.length / u.time);
  };
  return fmt::format(R"toml([gravity]
y_m_per_s2 = {}
[body.b]
x_m = 0
y_m = {}
angle_rad = 0.01
mass_kg = {}
inertia_kg_m2 = {}
{}{}[start]
given = ["b.x", "b.y", "b.angle"]
[run]
t_end_s = {}
[[cost.terminal]]
kind = "value"
output = "b.y"
)toml",
                     -kGravity * u.length / (u.time * u.time), 0.5 * u.length, u.mass,
                     0.1 * u.mass * u.length * u.length, corner("l", -0.5), corner("r", 0.5), 0.36 * u.time);
}

/// A parameter, its value in units and its unit.
struct InUnits {
  const char* name;
  double value;
  double (*unit)(const Units& u);
};

/// By the default method, psi being a length.
void check_in_all_units(std::string (*scene)(const Units& u), const std::vector<InUnits>& parameters) {
  std::vector<std::string> names;
  for (const InUnits& p : parameters) names.emplace_back(p.name);
  const GradientResult own = run(scene(kUnits[0]), names, "baumgarte", "idas-adjoint");
  double size = 0;
  for (std::size_t j = 0; j < names.size(); ++j) size = std::max(size, std::abs(own.gradient[j] * parameters[j].value));
  for (const Units& u : kUnits) {
    INFO(u.length << " m, " << u.time << " s, " << u.mass << " kg");
    const GradientResult r = run(scene(u), names, "baumgarte", "idas-adjoint");
    CHECK(std::abs(r.psi / u.length - own.psi) <= 1e-6 * std::abs(own.psi));
    for (std::size_t j = 0; j < names.size(); ++j)
      CHECK(std::abs(r.gradient[j] * parameters[j].unit(u) / u.length - own.gradient[j]) *
                std::abs(parameters[j].value) <=
            1e-5 * size);
  }
}

}  // namespace

TEST_CASE("small contacts: a ball lands, slides and rolls in units of its own, against its closed form") {
  const long double h = 1e-5L, mu = 0.15L;
  const auto psi = static_cast<double>(distance(mu)),
             slope = static_cast<double>((distance(mu + h) - distance(mu - h)) / (2 * h));
  for (const Units& u : kUnits)
    for (const auto& [formulation, method] :
         {std::pair{"baumgarte", "idas-adjoint"}, std::pair{"index2", "idas-adjoint"},
          std::pair{"index1", "cvodes-adjoint"}, std::pair{"maggi", "cvodes-adjoint"},
          std::pair{"maggi", "cvodes-forward"}, std::pair{"baumgarte", "hand-adjoint"}}) {
      INFO(formulation << " by " << method << ", " << u.length << " m, " << u.time << " s, " << u.mass << " kg");
      const GradientResult r = run(ball(u), {"contact.C.friction_coefficient"}, formulation, method);
      CHECK(std::abs(r.psi / u.length - psi) <= kOfPsi * psi);
      CHECK(std::abs(r.gradient[0] / u.length - slope) <= kOfGradient * std::abs(slope));
    }
}

TEST_CASE("small contacts: a ball in space bounces, slides and rolls the same in all units") {
  check_in_all_units(spinning_ball, {{"contact.C.friction_coefficient", 0.15, [](const Units&) { return 1.0; }}});
}

TEST_CASE("small contacts: a pendulum whose tip bounces and slides is the same in all units") {
  check_in_all_units(
      pendulum, {{"bar.a.mass_kg", 1.1, [](const Units& u) { return u.mass; }},
                 {"couple.c.k", 9, [](const Units& u) { return u.mass * u.length * u.length / (u.time * u.time); }},
                 {"couple.c.c", -0.5, [](const Units&) { return 1.0; }}});
}

// In 1e-8 of a second a corner of millimetres and microseconds covers three hundredths of a length: taken as one, the
// two impacts were another motion.
TEST_CASE("small contacts: corners that land one after the other do so in all units") {
  check_in_all_units(two_corners, {{"body.b.angle_rad", 0.01, [](const Units&) { return 1.0; }},
                                   {"body.b.y_m", 0.5, [](const Units& u) { return u.length; }}});
}
