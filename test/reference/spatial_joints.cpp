// Joints in space with coordinates, drivers and couplings against closed forms.
#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>

#include "run_scene.h"

using namespace costate;
using namespace costate::test;

namespace {

const std::string crank = R"(
[rigid_body.crank]
x_m = 0
y_m = 0
z_m = 0
mass_kg = 2
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.3
center_x_m = 0.2

[point.O]
ground = true
x_m = 0
y_m = 0
z_m = 0

[point.hub]
on = "crank"
x_m = 0
y_m = 0
z_m = 0

[point.tip]
on = "crank"
x_m = 1
y_m = 0.5
z_m = 0

[hinge.bearing]
points = ["O", "hub"]
axis_first = [1, 2, -2]
angle = "crank"
)";

const std::string given_nothing = "[start]\ngiven = []\n", given_angle = "[start]\ngiven = [\"crank.angle\"]\n";

}  // namespace

TEST_CASE("joint coordinates: a driven hinge follows every kind of law, through full turns") {
  using std::cos;
  using std::exp;
  using std::sin;
  struct Case {
    std::string law;
    std::function<double(double)> f;
    std::vector<double> times;
  };
  const auto all = times_to(2, 9);
  const auto quintic = [](double s) { return s <= 0 ? 0 : s >= 1 ? 1 : s * s * s * (10 - 15 * s + 6 * s * s); };
  const std::vector<Case> cases = {
      {R"({ kind = "polynomial", coefficients = [0.3, -9, 2] })", [](double t) { return 0.3 - 9 * t + 2 * t * t; },
       all},
      {R"({ kind = "sine", mean = 0.2, amplitude = 2, angular_frequency_rad_per_s = 5, phase_rad = 0.4 })",
       [](double t) { return 0.2 + 2 * sin(5 * t + 0.4); }, all},
      {R"({ kind = "smooth_step", from = 0.2, to = 1.4, before = 0, after = 15 })",
       [&](double t) { return 15 * quintic((t - 0.2) / 1.2); }, all},
      {R"({ kind = "table", x = [0, 0.5, 1, 1.5, 2], y = [0, 3, 9, 7, -4] })",
       [](double t) {
         return Values{0, 3, 9, 7, -4}[static_cast<std::size_t>(std::lround(2 * t))];
       },
       {0.5, 1, 1.5, 2}},
      {R"({ kind = "formula", formula = "a*sin(w*t)*exp(-t/T) + 2*pi*t^2", a = 1.5, w = 4, T = 0.8 })",
       [](double t) { return 1.5 * sin(4 * t) * exp(-t / 0.8) + 2 * std::numbers::pi * t * t; }, all},
      {R"({ kind = "sum", terms = [{ kind = "polynomial", coefficients = [0, 8] },
                                   { kind = "sine", amplitude = 1, angular_frequency_rad_per_s = 3 }] })",
       [](double t) { return 8 * t + sin(3 * t); }, all},
      {R"({ kind = "product", factors = [{ kind = "polynomial", coefficients = [0, 4] },
                                         { kind = "sine", amplitude = 1, angular_frequency_rad_per_s = 3 }] })",
       [](double t) { return 4 * t * sin(3 * t); }, all},
      {R"({ kind = "steps", at = [0.1, 0.9], values = [0, 7, -3], width = 0.7 })",
       [&](double t) { return 7 * quintic((t - 0.1) / 0.7) - 10 * quintic((t - 0.9) / 0.7); }, all},
      {"{ kind = \"chirp\", amplitude = 2, to = 2, first_angular_frequency_rad_per_s = 1, "
       "last_angular_frequency_rad_per_s = 9 }",
       [](double t) { return 2 * sin(t + 2 * t * t); }, all}};
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -2) / 3, arm(1, 0.5, 0);
  for (const Case& c : cases) {
    INFO(c.law);
    // The motion is prescribed: only the constraint, damped by the formulation, is integrated.
    const Scene scene = Scene::parse(
        crank + given_nothing + "[driver.motor]\ncoordinate = \"crank.angle\"\nlaw = " + c.law + "\n", "s.toml");
    const auto found = run(scene, c.times, {"crank.angle", "tip.x", "tip.y", "tip.z", "crank.omega_x"});
    for (std::size_t i = 0; i < c.times.size(); ++i) {
      const double t = c.times[i], angle = c.f(t), h = 1e-4;
      CAPTURE(t);
      CHECK(found[i][0] == Approx(angle).margin(kMotion * 10));
      const Eigen::Vector3d r = Eigen::AngleAxisd(angle, axis) * arm;  // Rodrigues
      for (int k = 0; k < 3; ++k) CHECK(found[i][static_cast<std::size_t>(1 + k)] == Approx(r[k]).margin(kMotion * 10));
      // The body's rate along its axis; central differences: h^2 f''' / 6 with f''' below 2e3.
      if (c.times.size() == all.size())
        CHECK(found[i][4] == Approx(axis[0] * (c.f(t + h) - c.f(t - h)) / (2 * h)).margin(1e-5));
    }
  }
}

TEST_CASE("joint coordinates: full turns accumulate and torques act on the angle") {
  // A damper and a constant couple on the angle alone: J w' = T - d w about the hinge, from rest.
  const double d = 0.3, T = 4;
  Eigen::Matrix3d J = Eigen::Vector3d(0.1, 0.3, 0.3).asDiagonal();
  const Eigen::Vector3d n = Eigen::Vector3d(1, 2, -2) / 3, c(0.2, 0, 0);
  const double inertia = n.dot(J * n) + 2 * c.cross(n).squaredNorm();
  const Scene scene = Scene::parse(crank + given_angle + R"([torsion_spring.damper]
angle = "crank"
damping_N_m_s_per_rad = 0.3
[couple.motor]
angle = "crank"
torque_N_m = 4
)",
                                   "s.toml");
  for (const char* formulation : {"baumgarte", "index1", "index2", "maggi"}) {
    CAPTURE(formulation);
    const auto times = times_to(4, 5);
    const auto found = run(scene, times, {"crank.angle"}, formulation);
    for (std::size_t i = 0; i < times.size(); ++i) {
      const double t = times[i], rate = d / inertia;
      const double angle = T / d * (t - (1 - std::exp(-rate * t)) / rate);  // up to 5 turns
      CHECK(found[i][0] == Approx(angle).epsilon(1e-7));
    }
    CHECK(found.back()[0] > 4 * std::numbers::pi);
  }
}

namespace {

// A rotor about a vertical spindle through A and a slider on a vertical guide, with or without the rotor's
// own slide.
const std::string bench = R"(
[gravity]
z_m_per_s2 = -9.81

[rigid_body.rotor]
x_m = 0
y_m = 0
z_m = 0
mass_kg = 1.5
inertia_xx_kg_m2 = 0.02
inertia_yy_kg_m2 = 0.02
inertia_zz_kg_m2 = 0.03

[rigid_body.slider]
x_m = 0.3
y_m = 0
z_m = 0
mass_kg = 2
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1

[point.A]
ground = true
x_m = 0
y_m = 0
z_m = 0

[point.B]
ground = true
x_m = 0.3
y_m = 0
z_m = 0

[point.hub]
on = "rotor"
x_m = 0
y_m = 0
z_m = 0

[point.shoe]
on = "slider"
x_m = 0
y_m = 0
z_m = 0
)";

}  // namespace

TEST_CASE("couplings: rack and pinion, screw and gears fall as one mass") {
  const double g = 9.81, t = 0.8, m = 2, I = 0.03;
  SECTION("rack and pinion: m + I / r^2") {
    const double r = 0.05;
    const Scene scene = Scene::parse(bench + R"(
[hinge.spindle]
points = ["A", "hub"]
axis_first = [0, 0, 1]
angle = "pinion"
[prismatic.guide]
points = ["B", "shoe"]
axis_first = [0, 0, 1]
displacement = "rack"
[rack_and_pinion.mesh]
angle = "pinion"
coordinate = "rack.displacement"
radius_m = 0.05
[start]
given = ["rack.displacement"]
)",
                                     "s.toml");
    const double a = -g * m / (m + I / (r * r));
    const auto found = run(scene, {t}, {"rack.displacement", "slider.z", "pinion.angle", "mesh.reaction"});
    CHECK(found[0][0] == Approx(a * t * t / 2).epsilon(1e-8));
    CHECK(found[0][1] == Approx(a * t * t / 2).epsilon(1e-8));
    CHECK(found[0][2] == Approx(a * t * t / 2 / r).epsilon(1e-8));
    CHECK(found[0][3] == Approx(m * (a + g)).epsilon(1e-8));  // the pinion holds the rack up
  }
  SECTION("screw: the nut is the rotor itself") {
    const double lead = 0.4, r = lead / (2 * std::numbers::pi), mass = 1.5;
    const Scene scene = Scene::parse(bench + R"(
[cylindrical.spindle]
points = ["A", "hub"]
axis_first = [0, 0, 1]
angle = "nut"
displacement = "nut"
[screw.thread]
angle = "nut"
coordinate = "nut.displacement"
lead_m_per_turn = 0.4
[fixed.slider]
points = ["B", "shoe"]
[start]
given = ["nut.angle"]
)",
                                     "s.toml");
    const double a = -g * mass / (mass + I / (r * r));
    const auto found = run(scene, {t}, {"rotor.z", "nut.angle", "slider.z"});
    CHECK(found[0][0] == Approx(a * t * t / 2).epsilon(1e-8));
    CHECK(found[0][1] == Approx(a * t * t / 2 / r).epsilon(1e-8));
    CHECK(std::abs(found[0][2]) < kMotion);
  }
  SECTION("gears: a couple on the first turns I1 + i^2 I2") {
    const double i = -2.5, T = 0.7, inertia = I + i * i * 0.1;
    const Scene scene = Scene::parse(bench + R"(
[hinge.spindle]
points = ["A", "hub"]
axis_first = [0, 0, 1]
angle = "first"
[hinge.other]
points = ["B", "shoe"]
axis_first = [0, 0, 1]
angle = "second"
[gear.mesh]
angles = ["first", "second"]
ratio = -2.5
[couple.motor]
angle = "first"
torque_N_m = 0.7
[start]
given = ["first.angle"]
)",
                                     "s.toml");
    const auto found = run(scene, {t}, {"first.angle", "second.angle", "slider.omega_z", "mesh.reaction"});
    const double a = T / inertia;
    CHECK(found[0][0] == Approx(a * t * t / 2).epsilon(1e-8));
    CHECK(found[0][1] == Approx(i * a * t * t / 2).epsilon(1e-8));
    CHECK(found[0][2] == Approx(i * a * t).epsilon(1e-8));
    CHECK(found[0][3] == Approx(0.1 * i * a).epsilon(1e-8));
  }
}

TEST_CASE("a planar joint: a puck slides down an incline and spins") {
  // Without friction: acceleration g sin(slope) down the plane, constant spin about the normal.
  const Scene scene = Scene::parse(R"(
[gravity]
z_m_per_s2 = -9.81
[rigid_body.puck]
x_m = 0.4
y_m = 0
z_m = 0.3
rotation_axis = [0, 1, 0]
angle_rad = 0.6435011087932844
vy_m_per_s = 0.5
omega_z_rad_per_s = 7
mass_kg = 2
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.2
[point.O]
ground = true
x_m = 0
y_m = 0
z_m = 0.6
[point.belly]
on = "puck"
x_m = 0
y_m = 0
z_m = 0
[planar.slope]
points = ["O", "belly"]
normal_first = [0.6, 0, 0.8]
normal_second = [0, 0, 1]
[start]
given = ["puck.x", "puck.y", "puck.e3"]
given_velocities = ["puck.x", "puck.y", "puck.omega_z"]
)",
                                   "s.toml");
  const double t = 1.2, way = 9.81 * 0.6 * t * t / 2;
  const auto found = run(scene, {t}, {"puck.x", "puck.y", "puck.z", "puck.omega_z"});
  CHECK(found[0][0] == Approx(0.4 + 0.8 * way).epsilon(1e-8));
  CHECK(found[0][1] == Approx(0.5 * t).epsilon(1e-8));
  CHECK(found[0][2] == Approx(0.3 - 0.6 * way).epsilon(1e-8));
  CHECK(found[0][3] == Approx(7).epsilon(1e-8));
}
