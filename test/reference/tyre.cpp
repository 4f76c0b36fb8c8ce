// Motions on tyres that have a closed form: the linear tyre with a relaxation length, driving and at rest.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "costate/integrator/simulate.h"
#include "costate/scene/scene.h"

using namespace costate;

namespace {

// A body of 100 kg that cannot turn (1e12 kg m^2) slides sideways on one tyre at v0 = 1e-4 m/s; no gravity,
// the tyre's radius is the height of the wheel, so that only the side force is left. Angles are below 1e-4,
// so that atan and tan change nothing beyond 1e-8 of the slip.
std::string scene(double forward, double slip_speed) {
  return fmt::format(R"([road.plain]
kind = "flat"
[rigid_body.car]
x_m = 0
y_m = 0
z_m = 0.3
vx_m_per_s = {}
vy_m_per_s = 1e-4
mass_kg = 100
inertia_xx_kg_m2 = 1e12
inertia_yy_kg_m2 = 1e12
inertia_zz_kg_m2 = 1e12
[point.hub]
on = "car"
x_m = 0
y_m = 0
z_m = 0
[tyre.T]
wheel = "hub"
road = "plain"
radius_m = 0.3
stiffness_N_per_m = 1e5
bilateral = true
model = "linear"
cornering_stiffness_N_per_rad = 5000
relaxation_length_m = 0.5
slip_speed_m_per_s = {}
[start]
given = ["car"]
)",
                     forward, slip_speed);
}

/// m v' = -C z, L z' = v - s z from v = v0, z = 0, by the eigenvalues of the pair.
std::array<double, 2> closed_form(double t, double s) {
  const double m = 100, C = 5000, L = 0.5, v0 = 1e-4;
  const std::complex<double> root = std::sqrt(std::complex<double>(s * s / (L * L) - 4 * C / (m * L)));
  const std::complex<double> a = (-s / L + root) / 2.0, b = (-s / L - root) / 2.0;
  // z = z1 (exp(a t) - exp(b t)) with z'(0) = v0 / L; v = L z' + s z.
  const std::complex<double> z1 = v0 / L / (a - b), z = z1 * (std::exp(a * t) - std::exp(b * t));
  const std::complex<double> rate = z1 * (a * std::exp(a * t) - b * std::exp(b * t));
  return {(L * rate + s * z).real(), z.real()};
}

}  // namespace

TEST_CASE("tyre: a linear tyre with a relaxation length, driving and at rest") {
  // Driving at 8 m/s; at rest without a slip speed, where the tyre is a spring of C / L; at rest with 0.1
  // m/s, where the spring creeps.
  struct Case {
    double forward, slip_speed, s;
  };
  for (const Case& c : {Case{8, 0, 8}, Case{0, 0, 0}, Case{0, 0.1, 0.1}}) {
    INFO("at " << c.forward << " m/s, slip speed " << c.slip_speed);
    const Scene read = Scene::parse(scene(c.forward, c.slip_speed), "tyre.toml");
    Problem p;
    p.mechanism = read.mechanism();
    p.parameters = p.mechanism->select({});
    p.formulation = "baumgarte";
    p.solver.integrator = "cvodes";
    p.solver.rtol = 1e-12;
    p.solver.atol = 1e-16;  // of numbers of 1e-4
    p.solver.t_end = 1;
    const auto v = make_output(*p.mechanism, "car.y_dot"), alpha = make_output(*p.mechanism, "T.slip_angle"),
               force = make_output(*p.mechanism, "T.lateral_force");
    simulate(p, {}, {0.1, 0.4, 1.0}, [&](const PhysicalState& x, System& system) {
      const auto [v_t, z_t] = closed_form(x.t, c.s);
      INFO("t = " << x.t);
      // The 1e-8 of the angles, and as much for the run: 1e4 times rtol of the size of the motion.
      CHECK(v->value(x, system.assembly()) == Approx(v_t).margin(2e-8 * 1e-4));
      CHECK(alpha->value(x, system.assembly()) == Approx(z_t).margin(2e-8 * 1e-4));
      CHECK(force->value(x, system.assembly()) == Approx(-5000 * z_t).margin(5000 * 2e-8 * 1e-4));
    });
  }
}
