// A wheel in the air over a bump of which the crest alone touches it: the damper lets go of it before the tyre does.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

/// Dropped with a tyre that is compressed by 10 mm at the start, so that it flies when it comes to the bump, 50 ms
/// later.
struct Hop {
  double speed, length, height, stiffness = 2e5;
  double start() const { return 0.05 * speed; }
};
constexpr double kDamping = 500, kMass = 40, kRadius = 0.3, kRamp = 1e-3, kEnd = 0.1, kGravity = 9.81;

Problem hopping(const Hop& hop) {
  return make_problem(Scene::parse(fmt::format(R"toml(
[gravity]
z_m_per_s2 = -9.81
[road.r]
kind = "profile"
law = {{ kind = "bump", height_m = {}, start_m = {}, length_m = {} }}
[rigid_body.w]
x_m = 0
y_m = 0
z_m = 0.29
vx_m_per_s = {}
mass_kg = 40
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1
inertia_zz_kg_m2 = 1
[point.hub]
on = "w"
x_m = 0
y_m = 0
z_m = 0
[tyre.T]
wheel = "hub"
road = "r"
model = "ride"
contact = "vertical"
radius_m = 0.3
stiffness_N_per_m = {}
damping_N_s_per_m = 500
[start]
given = ["w.x", "w.y", "w.z", "w.orientation"]
[[cost.terminal]]
kind = "value"
output = "w.z_dot"
[parameter.k]
number = "tyre.T.stiffness_N_per_m"
[run]
t_end_s = 0.1
parameters = ["k"]
)toml",
                                               hop.height, hop.start(), hop.length, hop.speed, hop.stiffness),
                                   "hop.toml"));
}

/// The wheel's vertical speed at the end, by Runge and Kutta's steps of 0.2 us: kinks of the force leave 1e-10 of it.
double vertical_speed(const Hop& hop) {
  const auto acceleration = [&](double t, double z, double w) {
    const double turn = 2 * std::acos(-1.0) / hop.length, at = hop.speed * t - hop.start();
    const bool on = at > 0 && at < hop.length;
    const double road = on ? hop.height * (1 - std::cos(turn * at)) : 0,
                 rate = on ? hop.height * turn * std::sin(turn * at) * hop.speed : 0, deflection = road + kRadius - z;
    if (!(deflection > 0)) return -kGravity;
    const double force = hop.stiffness * deflection + kDamping * (rate - w) * std::min(1.0, deflection / kRamp);
    return std::max(0.0, force) / kMass - kGravity;
  };
  constexpr int steps = 500000;
  const double h = kEnd / steps;
  double z = 0.29, w = 0;
  for (int i = 0; i < steps; ++i) {
    const double t = i * h, a1 = acceleration(t, z, w), a2 = acceleration(t + h / 2, z + h / 2 * w, w + h / 2 * a1),
                 a3 = acceleration(t + h / 2, z + h / 2 * (w + h / 2 * a1), w + h / 2 * a2),
                 a4 = acceleration(t + h, z + h * (w + h / 2 * a2), w + h * a3);
    z += h * w + h * h / 6 * (a1 + a2 + a3);
    w += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return w;
}

}  // namespace

// IDAS and CVODES had none of it where a step ended as the tyre was still compressed, and its damper had let go:
// -0.25645 in the place of -0.23588, said to 6.6e-07, by all formulations.
TEST_CASE("tyres: a bump that touches a wheel in flight", "[late]") {
  const Hop hop{10, 0.05, 0.005};
  const double psi = vertical_speed(hop), e = 40;
  CHECK(psi == Approx(-0.235875716238).epsilon(1e-7));  // DOP853 at 1e-10, of pieces of 1 us
  const double by_stiffness =
      (vertical_speed({10, 0.05, 0.005, 2e5 + e}) - vertical_speed({10, 0.05, 0.005, 2e5 - e})) / (2 * e);
  const Problem given = hopping(hop);
  for (const Formulation& f : formulations())
    for (const char* integrator : {"idas", "cvodes", "dopri5", "radau5"}) {
      Problem p = given;
      p.formulation = f.name;
      p.solver.integrator = integrator;
      CAPTURE(f.name, integrator);
      Simulation s;
      try {
        s = simulate(p, p.parameters.values());
      } catch (const CapabilityError&) {
        continue;
      }
      CHECK(std::abs(s.psi - psi) <= 5e-5 * std::abs(psi));
      take_notices();
    }
  for (const char* method : {"idas-adjoint", "idas-forward", "cvodes-adjoint", "cvodes-forward", "hand-adjoint"}) {
    CAPTURE(method);
    const GradientResult r = gradient(given, method, given.parameters.values());
    CHECK(std::abs(r.psi - psi) <= 1e-5 * std::abs(psi));
    CHECK(std::abs(r.gradient[0] - by_stiffness) <= 1e-2 * std::abs(by_stiffness));
    take_notices();
  }
}

TEST_CASE("tyres: bumps of many lengths under a wheel in flight", "[late]") {
  for (const double speed : {5.0, 10.0, 20.0, 40.0})
    for (const double length : {0.03, 0.05, 0.1, 0.2})
      for (const double height : {0.0045, 0.005, 0.01}) {
        const double psi = vertical_speed({speed, length, height});
        const Problem given = hopping({speed, length, height});
        for (const char* integrator : {"idas", "cvodes"}) {
          Problem p = given;
          p.solver.integrator = integrator;
          CAPTURE(speed, length, height, integrator);
          const Simulation s = simulate(p, p.parameters.values());
          const bool told = !take_notices().empty();
          // Of the speeds that it is made of, 0.25 m/s at the least.
          CHECK((told || std::abs(s.psi - psi) <= 1e-4 * std::max(0.25, std::abs(psi))));
        }
      }
}
