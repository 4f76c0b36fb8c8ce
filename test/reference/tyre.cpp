// Motions on tyres that have a closed form: the linear tyre with a relaxation length, driving and at rest.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "costate/integrator/simulate.h"
#include "costate/scene/scene.h"
#include "support/paths.h"

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
    simulate(p, p.parameters.values(), {0.1, 0.4, 1.0}, [&](const MechanismState& x, System& system) {
      const auto [v_t, z_t] = closed_form(x.t, c.s);
      INFO("t = " << x.t);
      // The 1e-8 of the angles, and as much for the run: 1e4 times rtol of the size of the motion.
      CHECK(v->value(x, system.assembly()) == Approx(v_t).epsilon(1e-12).margin(2e-8 * 1e-4));
      CHECK(alpha->value(x, system.assembly()) == Approx(z_t).epsilon(1e-12).margin(2e-8 * 1e-4));
      CHECK(force->value(x, system.assembly()) == Approx(-5000 * z_t).epsilon(1e-12).margin(5000 * 2e-8 * 1e-4));
    });
  }
}

TEST_CASE("tyre: a step of steer settles over the relaxation length of the load, and a standing start does not") {
  // A carrier too heavy to be moved holds the wheel at a load and a slip: from z = 0, over the length
  // sigma_alpha of this load, z = tan(alpha) (1 - exp(-V t / sigma_alpha)). At rest, where only the slip
  // speed w = 0.1 m/s is left of V, sideways sliding builds up slip at v / sigma_alpha.
  struct Case {
    double load, forward, lateral;
  };
  for (const Case& c : {Case{2000, 15, 0.3}, Case{5000, 15, 0.3}, Case{3000, 0, 0.001}}) {
    INFO(c.load << " N at " << c.forward << " m/s");
    const Scene read = Scene::parse(fmt::format(R"([road.plain]
kind = "flat"
[rigid_body.car]
x_m = 0
y_m = 0
z_m = {}
vx_m_per_s = {}
vy_m_per_s = {}
mass_kg = 1e15
inertia_xx_kg_m2 = 1e15
inertia_yy_kg_m2 = 1e15
inertia_zz_kg_m2 = 1e15
[point.hub]
on = "car"
x_m = 0
y_m = 0
z_m = 0
[tyre.T]
wheel = "hub"
road = "plain"
radius_m = 0.3
stiffness_N_per_m = 2e5
model = "magic_formula"
generation = "5.2"
free_rolling = true
relaxation = "coefficients"
magic_formula = {{ FNOMIN = 4000, UNLOADED_RADIUS = 0.3, PCX1 = 1.6, PDX1 = 1, PCY1 = 1.3, PDY1 = 0.9, PKY1 = -20, PKY2 = 2, PTY1 = 2.1, PTY2 = 1.9 }}
[start]
given = ["car"]
)",
                                                0.3 - c.load / 2e5, c.forward, c.lateral),
                                    "tyre.toml");
    Problem p;
    p.mechanism = read.mechanism();
    p.parameters = p.mechanism->select({});
    p.formulation = "baumgarte";
    p.solver.integrator = "cvodes";
    p.solver.rtol = 1e-10;
    p.solver.atol = 1e-14;  // of slips of 1e-4
    p.solver.t_end = 0.2;
    const double sigma = 2.1 * 0.3 * std::sin(2 * std::atan(c.load / (1.9 * 4000))),
                 s = c.forward > 0 ? c.forward : 0.1;
    const auto slip = make_output(*p.mechanism, "T.slip_angle"), force = make_output(*p.mechanism, "T.lateral_force");
    simulate(p, p.parameters.values(), {0.01, 0.05, 0.2}, [&](const MechanismState& x, System& system) {
      INFO("t = " << x.t);
      const double z = c.lateral / s * (1 - std::exp(-s * x.t / sigma));
      // A thousand times the run's tolerance.
      CHECK(std::tan(slip->value(x, system.assembly())) == Approx(z).epsilon(1e-7));
      CHECK(std::isfinite(force->value(x, system.assembly())));
    });
  }
}

TEST_CASE("tyre: the golden car's transfer functions on a swinging post") {
  // Heights of body and axle over that of the post, by an independent solution of the linear quarter car
  // (ASTM E1926) for motions exp(i omega t). The post starts at full amplitude; by 10 s its transient has
  // died down by exp(-25.9).
  struct Row {
    double frequency;
    std::complex<double> body, axle;
  };
  const Row rows[] = {
      {0.5, {1.1878159804322706, -0.060189679999977193}, {1.0202660293141481, -0.00091178894342000223}},
      {1.0, {1.5875040398537428, -0.90943879216994358}, {1.1060055896092692, -0.055485105741470163}},
      {1.2, {1.1434469029781242, -1.5308649471940041}, {1.1140949269330973, -0.13503756813857692}},
      {2.0, {-0.18436277616761002, -0.8022685645339267}, {0.99137733918361109, -0.20131347018893673}},
      {5.0, {-0.11474929944351541, -0.21301893916872331}, {1.0688991743515231, -0.41635566948363697}},
      {8.0, {-0.145265929593944, -0.11767920922875378}, {1.0436528358901256, -1.0851193090772503}},
      {10.0, {-0.1597675414560892, -0.024798767559412605}, {0.36602532770144488, -1.6095954757464071}},
      {12.0, {-0.098431983235984078, 0.04373748283319816}, {-0.46774648653760427, -1.2448711582645335}},
      {20.0, {-0.0063862861678362025, 0.015703260943867033}, {-0.32182210402366106, -0.14453297576520282}}};
  for (const Row& row : rows) {
    const double omega = 6.283185307179586 * row.frequency, h = 0.01;
    const Scene read = Scene::load(
        COSTATE_MODELS_DIR "/golden_car/golden_car.toml",
        {fmt::format("road.post.law={{ kind = 'sine', amplitude = {}, angular_frequency_rad_per_s = {:.17g} }}", h,
                     omega),
         "road.post.speed_m_per_s=1.0"});
    Problem p;
    p.mechanism = read.mechanism();
    p.parameters = p.mechanism->select({});
    p.formulation = "baumgarte";
    p.solver.integrator = "cvodes";
    p.solver.rtol = 1e-11;
    p.solver.t_end = 10.5;
    const auto body = make_output(*p.mechanism, "body.z"), axle = make_output(*p.mechanism, "axle.z");
    simulate(p, p.parameters.values(), {10.0, 10.13, 10.5}, [&](const MechanismState& x, System& system) {
      INFO(row.frequency << " Hz, t = " << x.t);
      const std::complex<double> turn = h * std::polar(1.0, omega * x.t);
      // The rest of the transient, 6e-12 of 0.02 m, and the run's error, a thousand times its tolerance of
      // heights of 1 m.
      CHECK(body->value(x, system.assembly()) - 1 == Approx((row.body * turn).imag()).epsilon(1e-12).margin(1e-8));
      CHECK(axle->value(x, system.assembly()) - 0.3 == Approx((row.axle * turn).imag()).epsilon(1e-12).margin(1e-8));
    });
  }
}
