// Second derivatives of psi through rigid contacts that close, let go, stick and slide in the plane, and through
// Poisson's restitution (lib/README.md (13.16), (13.17)), against closed forms.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "property/hessian_compare.h"
#include "property/rough_box.h"
#include "support/paths.h"
#include "support/with_words.h"

using namespace costate;
using namespace costate::test;

namespace {

/// A mass on or above the ground.
std::string mass_point(const std::string& contact, const std::string& more) {
  return fmt::format(R"([gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0
[mass.P]
point = "P"
mass_kg = 2
[contact.floor]
kind = "rigid"
point = "P"
{}
{}
[parameter.m]
number = "mass.P.mass_kg"
[parameter.g]
number = "gravity.y_m_per_s2"
factors = [-1]
)",
                     contact, more);
}

}  // namespace

TEST_CASE("hessian contacts: a mass that is lifted off, against its closed form") {
  // N = m g - k t is 0 at m g/k; from there y = k tau^3/(6 m).
  const Problem p = unconfirmed(with_words(mass_point("closed = true", R"([force.lift]
point = "P"
k = 30
formula_y_N = "k*t"
[start]
given = ["P.x"]
[run]
t_end_s = 1.3
rtol = 1e-11
parameters = ["m", "g", "force.lift.k"]
[[cost.terminal]]
kind = "value"
output = "P.y"
[[cost.running]]
kind = "square"
output = "P.y_dot"
)"),
                                           {{"x_m = 0\n", "x_m = 0.5\n"}}));
  const auto psi = [](const long double* r) {
    const long double m = r[0], g = r[1], k = r[2], tau = 1.3L - m * g / k;
    return k * tau * tau * tau / (6 * m) + k * k / (4 * m * m) * std::pow(tau, 5.0L) / 5;
  };
  check_closed(p, psi, {2e-3L, 1e-2L, 3e-2L});
}

TEST_CASE("hessian contacts: a mass that lands on a smooth slope, against its closed form") {
  // It falls from h and keeps its speed along the slope alone, where it goes on with g sin(slope).
  const Problem p = unconfirmed(with_words(mass_point("ground_angle_rad = -0.3", R"([start]
given = ["P.x", "P.y"]
[run]
t_end_s = 0.7
rtol = 1e-11
parameters = ["h", "slope", "g", "m"]
[parameter.h]
number = "point.P.y_m"
[parameter.slope]
number = "contact.floor.ground_angle_rad"
factors = [-1]
[[cost.terminal]]
kind = "value"
output = "P.x"
[[cost.running]]
kind = "value"
output = "floor.normal_force"
weight = 0.1
)"),
                                           {{"y_m = 0\n", "y_m = 0.8\n"}}));
  const auto psi = [](const long double* r) {
    const long double h = r[0], slope = r[1], g = r[2], m = r[3], fall = std::sqrt(2 * h / g), tau = 0.7L - fall;
    return (g * fall * tau + g * tau * tau / 2) * std::sin(slope) * std::cos(slope) +
           0.1L * m * g * std::cos(slope) * tau;
  };
  check_closed(p, psi, {1e-3L, 1e-3L, 1e-2L, 2e-3L});
}

TEST_CASE("hessian contacts: a mass that begins to slide, against its closed form") {
  // Pushed by k t it sticks until mu m g/k; from there x = k tau^3/(6 m).
  const Problem p =
      unconfirmed(mass_point("closed = true\nalong_m = 0\nfriction = \"coulomb\"\nfriction_coefficient = 0.4",
                             R"([force.push]
point = "P"
k = 20
formula_x_N = "k*t"
[start]
given = []
[run]
t_end_s = 1.2
rtol = 1e-11
parameters = ["m", "g", "force.push.k", "contact.floor.friction_coefficient"]
[[cost.terminal]]
kind = "value"
output = "P.x"
[[cost.running]]
kind = "value"
output = "floor.friction_force"
weight = 0.01
)"));
  const auto psi = [](const long double* r) {
    const long double m = r[0], g = r[1], k = r[2], mu = r[3], slips = mu * m * g / k, tau = 1.2L - slips;
    return k * tau * tau * tau / (6 * m) - 0.01L * (k * slips * slips / 2 + mu * m * g * tau);
  };
  check_closed(p, psi, {2e-3L, 1e-2L, 2e-2L, 4e-4L});
}

TEST_CASE("hessian contacts: a mass that slides up a slope and stops, or slides back, against closed forms") {
  // From v it stops after v/(g (sin + mu cos)); by mu > tan it stays there.
  for (const double mu : {0.2, 0.9}) {
    CAPTURE(mu);
    const Problem p = unconfirmed(
        with_words(mass_point(fmt::format("closed = true\nsliding = \"forward\"\nground_angle_rad = 0.5\nfriction = "
                                          "\"coulomb\"\nfriction_coefficient = {}",
                                          mu),
                              R"([start]
given = ["P.x"]
[run]
t_end_s = 1.1
rtol = 1e-11
parameters = ["v", "slope", "g", "contact.floor.friction_coefficient"]
[parameter.v]
number = "point.P.vx_m_per_s"
[parameter.slope]
number = "contact.floor.ground_angle_rad"
[[cost.terminal]]
kind = "value"
output = "P.x"
)"),
                   {{"x_m = 0\n", "x_m = 0\nvx_m_per_s = 3\n"}}));
    const auto psi = [mu](const long double* r) {
      const long double slope = r[1], g = r[2], s = std::sin(slope), c = std::cos(slope), v = r[0] / c,
                        up = g * (s + r[3] * c), stops = v / up, tau = 1.1L - stops;
      const long double down = mu > 0.6 ? 0 : g * (s - r[3] * c);
      return (v * v / (2 * up) - down * tau * tau / 2) * c;
    };
    check_closed(p, psi, {3e-3L, 1e-3L, 1e-2L, 1e-3L});
  }
}

TEST_CASE("hessian contacts: a ball that slides until it rolls, against its closed form") {
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/thrown.toml"));
  p.parameters = p.mechanism->select({"speed", "friction", "inertia", "slope"});
  p.solver.integrator.clear();
  const auto psi = [](const long double* r) {
    const long double g = 9.81L, k = r[2] / (0.6L * 0.01L), s = std::sin(r[3]), c = std::cos(r[3]), v0 = r[0] / c;
    // Along the slope s = x/cos: slides by -g (sin + mu cos), turns by mu g cos/(k R); then rolls by -g sin/(1 + k).
    const long double slides = -g * (s + r[1] * c), rolls = -g * s / (1 + k), stop = v0 / (-slides + r[1] * g * c / k),
                      v = v0 + slides * stop, tau = 1 - stop;
    return (v0 * stop + slides * stop * stop / 2 + v * tau + rolls * tau * tau / 2) * c;
  };
  check_closed(p, psi, {2e-3L, 2e-4L, 2e-6L, 1e-3L});
}

TEST_CASE("hessian contacts: Poisson's restitution of a ball, against its closed form") {
  // Of one contact without friction it is Newton's: the height at 2.8 s plus its integral until then.
  Problem p = make_problem(
      Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/drop.toml", {"contact.floor.restitution_law=\"poisson\""}));
  p.solver.integrator.clear();
  const auto psi = [](const long double* r) {
    const long double g = 9.81L, end = 2.8L, ground = r[2];
    long double t = std::sqrt(2 * (r[0] - ground) / g), v = g * t, sum = r[0] * t - g * t * t * t / 6;
    for (;;) {
      v *= r[1];
      const long double left = end - t, h = std::min(2 * v / g, left);
      sum += ground * h + v * h * h / 2 - g * h * h * h / 6;
      if (h == left) return sum + ground + v * h - g * h * h / 2;
      t += h;
    }
  };
  check_closed(p, psi, {1e-3L, 1e-3L, 1e-3L});
}

namespace {

/// By its friction and mass, and by `parameter`.
Problem box(std::vector<std::pair<std::string, std::string>> words, const std::string& parameter) {
  words.insert(words.end(), {{"SPEED", "1"}, {"START", parameter}});
  Problem p = make_box(words);
  p.solver.rtol = 1e-11;
  return unconfirmed(p);
}

}  // namespace

TEST_CASE("hessian contacts: a box slides to rest on both corners, against its closed form") {
  // x = v^2/(2 mu g).
  const Problem p = box({{"LEFT", "sliding = \"forward\""}, {"RIGHT", "sliding = \"forward\""}, {"VELOCITIES", ""}},
                        "body.box.vx_m_per_s");
  const auto psi = [](const long double* r) { return r[2] * r[2] / (2 * r[0] * 9.81L); };
  check_closed(p, psi, {3e-4L, 2e-3L, 1e-3L});
}

TEST_CASE("hessian contacts: a box begins to slide, one corner before the other, against its closed form") {
  // Pushed by k t at its centre it slides from mu m g/k on, when the corner that is pressed more reaches its limit,
  // too: x = k tau^3/(6 m). Who bears how much of the friction until then is some 1e-5 of it (AccelerationLevel), and
  // the instant of the second corner's limit as much.
  const Problem p =
      box({{"MORE", "[force.push]\npoint = \"c\"\nk = 4\nformula_x_N = \"k*t\""}, {"END", "2"}}, "force.push.k");
  const auto psi = [](const long double* r) {
    const long double tau = 2 - r[0] * r[1] * 9.81L / r[2];
    return r[2] * tau * tau * tau / (6 * r[1]);
  };
  check_closed(p, psi, {3e-4L, 2e-3L, 4e-3L});
}

TEST_CASE("hessian contacts: bounces that die out, and then it rests") {
  // models/bouncing_ball/drop.toml, until 4.5 s: heights are v0^3/(3 g^2) (1 + e^3)/(1 - e^3) s m over the ground. What
  // is left out is below (3e-5)^3 of that; penalties add some 1e-8 at each of 48 bounces.
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/drop.toml", {"run.t_end_s=4.5"}));
  p.solver.integrator.clear();
  const auto psi = [](const long double* r) {
    const long double g = 9.81L, v = std::sqrt(2 * g * (r[0] - r[2])), e = r[1] * r[1] * r[1];
    return r[2] + 4.5L * r[2] + v * v * v / (3 * g * g) * (1 + e) / (1 - e);
  };
  check_closed(p, psi, {1e-3L, 1e-3L, 1e-3L}, 5e-7);
}
