// Second derivatives of psi through events (lib/README.md (13.14) to (13.16)): touches of compliant contacts, bounces
// of rigid ones, ends that an event decides. Against closed forms, and against extrapolated differences of gradients by
// another formulation and integrator, which hold no second derivative; exact ones are symmetric besides.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "property/falling_box.h"
#include "property/free_pendulum.h"
#include "property/hessian_compare.h"
#include "property/rigid_scenes.h"
#include "support/paths.h"
#include "support/with_words.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;
using Eigen::MatrixXd;

namespace {

/// Errors of a product are those of gradients, kSteps rtol (gradients.cpp).
constexpr double kSteps = 1e3;

/// A ball over the ground, with what it meets there and what is asked of it.
std::string ball(double end, const std::string& contact, const std::string& cost, const std::string& parameters) {
  return fmt::format(R"([gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0.4
vx_m_per_s = 1
[mass.P]
point = "P"
mass_kg = 0.5
[contact.floor]
point = "P"
{}
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = {}
rtol = 1e-11
parameters = [{}]
[parameter.y]
number = "point.P.y_m"
[parameter.m]
number = "mass.P.mass_kg"
{}
)",
                     contact, end, parameters, cost);
}
std::string term(const std::string& when, const std::string& kind, const std::string& output) {
  return fmt::format("[[cost.{}]]\nkind = \"{}\"\noutput = \"{}\"\n", when, kind, output);
}

/// Falls from y onto m d'' = m g - K d - C d', until that force would pull, and flies: the height and twice the square
/// of the speed at the time T.
long double on_spring(long double T, const long double* p) {
  const long double g = 9.81L, y = p[0], m = p[1], K = p[2], C = p[3], fall = std::sqrt(2 * y / g), v = g * fall,
                    D = C / (2 * m), w = std::sqrt(K / m - D * D), rest = m * g / K;
  // d = rest + e^(-D t) (a cos w t + b sin w t) is 0 with the rate v.
  const long double a = -rest, b = (v + D * a) / w;
  const auto depth = [&](long double t) {
    return rest + std::exp(-D * t) * (a * std::cos(w * t) + b * std::sin(w * t));
  };
  const auto rate = [&](long double t) {
    return std::exp(-D * t) * ((w * b - D * a) * std::cos(w * t) - (w * a + D * b) * std::sin(w * t));
  };
  const auto force = [&](long double t) { return K * depth(t) + C * rate(t); };
  const long double pi = std::acos(-1.0L);
  long double in = T - fall, height = 0, speed = 0;
  long double low = pi / w / 2, high = 2 * pi / w;  // it lets go behind the deepest place
  for (int k = 0; k < 200; ++k) (force((low + high) / 2) > 0 ? low : high) = (low + high) / 2;
  if (in < low) {
    height = -depth(in);
    speed = -rate(in);
  } else {
    // Still within the ground by d(low), which it leaves as it flies.
    const long double flight = in - low;
    height = -depth(low) - rate(low) * flight - g * flight * flight / 2;
    speed = -rate(low) - g * flight;
  }
  return height + 2 * speed * speed;
}

const std::string kViscous =
    "law = \"kelvin-voigt\"\nexponent = 1\nstiffness_N_per_m_n = 2000\ndamping_N_s_per_m = 6\n";
const std::string kOfLaw = R"([parameter.K]
number = "contact.floor.stiffness_N_per_m_n"
[parameter.C]
number = "contact.floor.damping_N_s_per_m"
)";

}  // namespace

TEST_CASE("hessian events: a touch at which the force jumps, against its closed form") {
  // Within the ground at 0.32 s, in flight at 0.6 s: the touch, where the force ends, and the release.
  for (const double T : {0.32, 0.6}) {
    CAPTURE(T);
    const Problem p = unconfirmed(ball(
        T, kViscous, kOfLaw + term("terminal", "value", "P.y") + term("terminal", "square", "P.y_dot") + "weight = 2\n",
        R"("y", "m", "K", "C")"));
    const auto rho = p.parameters.values();
    const MatrixXd expected =
        hessian_of([T](const long double* x) { return on_spring(T, x); }, rho, {4e-5L, 5e-5L, 0.2L, 6e-4L});
    check_closed(p, expected, kSteps * p.solver.rtol + 1e-7);
  }
}

TEST_CASE("hessian events: speeds that are latched, friction along, and costs that begin at the touch") {
  const std::string cost = term("running", "square", "floor.normal_force") + "weight = 1e-3\n" +
                           term("running", "value", "floor.penetration") + term("terminal", "value", "P.x") +
                           term("terminal", "square", "P.y_dot");
  const auto contact = [](const char* law, const char* friction) {
    return fmt::format(
        "law = \"{}\"\nexponent = 1.5\nstiffness_N_per_m_n = 2e4\nrestitution = 0.7\nground_angle_rad = 0.1\n{}", law,
        friction);
  };
  const std::string numbers = R"([parameter.K]
number = "contact.floor.stiffness_N_per_m_n"
[parameter.e]
number = "contact.floor.restitution"
[parameter.slope]
number = "contact.floor.ground_angle_rad"
[parameter.mu]
number = "contact.floor.friction_coefficient"
)";
  // The derivative of d^1.5 grows as the root of the time since the touch, which is known to some spacings of numbers:
  // 1e-15 s of 1e-2 s are 3e-7 of it, and of each touch and release.
  for (const char* law : {"hunt-crossley", "lankarani-nikravesh", "flores"}) {
    CAPTURE(law);
    check_by_differences(unconfirmed(ball(0.7,
                                          contact(law,
                                                  "friction = \"coulomb\"\nfriction_coefficient = 0.3\n"
                                                  "transition_velocity_m_per_s = 0.1\n"),
                                          numbers + cost, R"("y", "m", "K", "e", "slope", "mu")")),
                         1e-5);
  }
}

TEST_CASE("hessian events: the height from which a ball bounces, against a closed form") {
  // models/bouncing_ball/drop.toml: the height at 2.8 s plus its integral until then, behind five bounces.
  const auto dropped = [](const long double* p) {
    const long double g = 9.81L, end = 2.8L, ground = p[2];
    long double t = std::sqrt(2 * (p[0] - ground) / g), v = g * t, psi = p[0] * t - g * t * t * t / 6;
    for (;;) {
      v *= p[1];
      const long double left = end - t, h = std::min(2 * v / g, left);
      psi += ground * h + v * h * h / 2 - g * h * h * h / 6;
      if (h == left) return psi + ground + v * h - g * h * h / 2;
      t += h;
    }
  };
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/drop.toml"));
  p.solver.integrator.clear();
  check_closed(p, hessian_of(dropped, p.parameters.values(), {1e-3L, 1e-3L, 1e-3L}), kSteps * p.solver.rtol + 1e-7);
}

TEST_CASE("hessian events: the corner of a box in space bounces, against a closed form") {
  // It falls without turning; the impulse of the floor at the corner's (x, y) from the centre throws the centre up.
  const Problem p = unconfirmed(kFallingBox);
  const auto psi = [](const long double* r) {
    const long double g = 9.81L, h = r[3] - 0.2L, v = std::sqrt(2 * h * g), left = 0.5L - v / g,
                      W = 1 / r[1] + 0.04L / r[2] + 0.01L / 0.05L, impulse = (1 + r[0]) * v / W;
    return 0.2L + (impulse / r[1] - v) * left - g * left * left / 2;
  };
  check_closed(p, hessian_of(psi, p.parameters.values(), {6e-4L, 1.4e-3L, 3e-5L, 7e-4L}), kSteps * 1e-11 + 1e-7);
}

TEST_CASE("hessian events: impacts with friction, of what is jointed") {
  // A hanging rod of two parts, the lower one's tip strikes a slope, slides behind one and sticks behind the other.
  const auto rods = [](double mu) {
    return unconfirmed(with_words(
        kRods,
        {{"CONTACT",
          fmt::format("restitution = 0.5\nfriction = \"coulomb\"\nfriction_coefficient = {}\nclosing_speed_m_per_s = 0",
                      mu)},
         {"END", "0.6"},
         {"[\"slope\"", "[\"e\", \"mu\", \"slope\""},
         {"[parameter.slope]",
          "[parameter.e]\nnumber = \"contact.floor.restitution\"\n[parameter.mu]\nnumber = "
          "\"contact.floor.friction_coefficient\"\n[parameter.slope]"}}));
  };
  for (const double mu : {0.1, 2.0}) {
    CAPTURE(mu);
    check_by_differences(rods(mu), 1e-6);
  }
}

TEST_CASE("hessian events: a pendulum's time to the bottom, against the elliptic integral") {
  // T = sqrt(L/g) K(sin(theta0/2)).
  Problem p = unconfirmed(free_pendulum("{ output = \"P.x\", below = 0.0 }", R"(rtol = 1e-11
parameters = ["L", "g", "from"]
[parameter.from]
number = "angle.swing.angle_rad"
[[cost.terminal]]
kind = "value"
output = "time"
)"));
  const auto time = [](const long double* r) {
    const long double k = std::sin((std::acos(-1.0L) / 2 + r[2]) / 2);
    long double a = 1, b = std::sqrt(1 - k * k);
    for (int i = 0; i < 20; ++i) {
      const long double mean = (a + b) / 2;
      b = std::sqrt(a * b);
      a = mean;
    }
    return std::sqrt(r[0] / r[1]) * std::acos(-1.0L) / (2 * a);
  };
  auto rho = p.parameters.values();
  const MatrixXd expected = hessian_of(time, rho, {1.3e-3L, 1e-2L, 3e-4L});
  for (const char* formulation : {"index1", "baumgarte"}) {
    p.formulation = formulation;
    const Hessian h = hessian(p, rho);
    const double off = apart(p, h.matrix, expected);
    CAPTURE(formulation, off, h.asymmetry);
    INFO(h.matrix << "\n\n" << expected);
    CHECK(off < kSteps * 1e-11 + 1e-7);
    CHECK(h.asymmetry < kSteps * 1e-11 + 1e-7);
  }
}

TEST_CASE("hessian events: ends by an event behind a touch, with costs on the way") {
  const std::string ends = "ends_when = { output = \"P.y\", above = 0.05 }\n";
  std::string scene = ball(3, kViscous,
                           kOfLaw + term("running", "square", "P.y") + term("terminal", "square", "P.y_dot") +
                               term("terminal", "value", "time"),
                           R"("y", "m", "K", "C")");
  scene.insert(scene.find("rtol"), ends);
  check_by_differences(unconfirmed(scene), 1e-6);
}
