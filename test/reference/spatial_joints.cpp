// Joints in space with coordinates, couplings, free points and bodies in natural coordinates against closed forms and
// against the same mechanism in other coordinates. Tolerances: the runs have rtol 1e-11 and up to 1e3 steps, whose errors
// add up to 1e-8 of the size of the motion where it does not amplify them.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <numbers>

#include "costate/integrator/simulate.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

constexpr double kRtol = 1e-11, kMotion = 1e-8;

Problem problem_of(const Scene& scene, double t_end, const std::string& formulation = "baumgarte",
                   const std::vector<std::string>& parameters = {}) {
  Problem p;
  p.mechanism = scene.mechanism();
  p.objective = scene.objective();
  p.parameters = p.mechanism->select(parameters);
  p.formulation = formulation;
  p.formulation_options = scene.formulation;
  p.solver.rtol = kRtol;
  p.solver.t_end = t_end;
  return p;
}

using Values = std::vector<double>;

/// The outputs at each time.
std::vector<Values> run(const Scene& scene, const std::vector<double>& times, const std::vector<std::string>& names,
                        const std::string& formulation = "baumgarte") {
  std::vector<std::unique_ptr<Output>> outputs;
  for (const auto& name : names) outputs.push_back(make_output(*scene.mechanism(), name));
  std::vector<Values> result;
  const Problem p = problem_of(scene, times.back(), formulation);
  simulate(p, p.parameters.values(), times, [&](const PhysicalState& s, System& system) {
    Values row;
    for (const auto& o : outputs) row.push_back(o->value(s, system.assembly()));
    result.push_back(row);
  });
  return result;
}

std::vector<double> times_to(double end, int count) {
  std::vector<double> t;
  for (int i = 1; i <= count; ++i) t.push_back(end * i / count);
  return t;
}

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

[start]
given = []
)";

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
  const auto quintic = [](double s) {
    return s <= 0 ? 0 : s >= 1 ? 1 : s * s * s * (10 - 15 * s + 6 * s * s);
  };
  const std::vector<Case> cases = {
      {R"({ kind = "polynomial", coefficients = [0.3, -9, 2] })", [](double t) { return 0.3 - 9 * t + 2 * t * t; }, all},
      {R"({ kind = "sine", mean = 0.2, amplitude = 2, angular_frequency_rad_per_s = 5, phase_rad = 0.4 })",
       [](double t) { return 0.2 + 2 * sin(5 * t + 0.4); }, all},
      {R"({ kind = "smooth_step", from = 0.2, to = 1.4, before = 0, after = 15 })",
       [&](double t) { return 15 * quintic((t - 0.2) / 1.2); }, all},
      {R"({ kind = "table", x = [0, 0.5, 1, 1.5, 2], y = [0, 3, 9, 7, -4] })",
       [](double t) { return Values{0, 3, 9, 7, -4}[static_cast<std::size_t>(std::lround(2 * t))]; },
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
    const Scene scene =
        Scene::parse(crank + "[driver.motor]\ncoordinate = \"crank.angle\"\nlaw = " + c.law + "\n", "s.toml");
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
  const std::string text = crank + R"([torsion_spring.damper]
angle = "crank"
damping_N_m_s_per_rad = 0.3
[couple.motor]
angle = "crank"
torque_N_m = 4
)";
  const Scene scene = Scene::parse(std::string(text).replace(text.find("given = []"), 10, "given = [\"crank.angle\"]"),
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

// A rotor about a vertical spindle through A and a slider on a vertical guide, with or without the rotor's own slide.
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

namespace {

/// Two bodies welded at an odd angle, spinning freely, or the one body that they make.
std::string welded(const std::string& kind) {
  return "[" + kind + R"(.a]
x_m = 0
y_m = 0
z_m = 0
vx_m_per_s = 0.3
omega_x_rad_per_s = 1
omega_y_rad_per_s = 2
omega_z_rad_per_s = -1.5
mass_kg = 2
inertia_xx_kg_m2 = 0.2
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.4
[)" + kind + R"(.b]
x_m = 1
y_m = 0
z_m = 0.5
rotation_axis = [1, 2, 0.5]
angle_rad = 0.9
mass_kg = 1
inertia_xx_kg_m2 = 0.05
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.08
[point.p]
on = "a"
x_m = 1
y_m = 0
z_m = 0.5
[point.q]
on = "b"
x_m = 0
y_m = 0
z_m = 0
[fixed.weld]
points = ["p", "q"]
[point.mark]
on = "a"
x_m = 0.3
y_m = -0.2
z_m = 0.7
[start]
given = ["a"]
)";
}

}  // namespace

TEST_CASE("a fixed joint: two welded bodies move as the one that they make, in either coordinates") {
  // Mass 3, centre (1/3, 0, 1/6); tensors about it by Steiner, the second one's turned into the first one's frame.
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.9, Eigen::Vector3d(1, 2, 0.5).normalized()).toRotationMatrix();
  const Eigen::Vector3d center = Eigen::Vector3d(1, 0, 0.5) / 3;
  const auto steiner = [](double m, const Eigen::Vector3d& d) -> Eigen::Matrix3d {
    return m * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  };
  const Eigen::Matrix3d Ja = Eigen::Vector3d(0.2, 0.3, 0.4).asDiagonal(), Jb = Eigen::Vector3d(0.05, 0.1, 0.08).asDiagonal();
  const Eigen::Matrix3d J = Ja + steiner(2, -center) + turn * Jb * turn.transpose() +
                            steiner(1, Eigen::Vector3d(1, 0, 0.5) - center);
  std::string one = "[rigid_body.a]\nx_m = 0\ny_m = 0\nz_m = 0\nvx_m_per_s = 0.3\nomega_x_rad_per_s = 1\n"
                    "omega_y_rad_per_s = 2\nomega_z_rad_per_s = -1.5\nmass_kg = 3\n";
  const auto add = [&](const char* key, double x) { one += fmt::format("{} = {:.17g}\n", key, x); };
  add("inertia_xx_kg_m2", J(0, 0));
  add("inertia_yy_kg_m2", J(1, 1));
  add("inertia_zz_kg_m2", J(2, 2));
  add("inertia_xy_kg_m2", J(0, 1));
  add("inertia_xz_kg_m2", J(0, 2));
  add("inertia_yz_kg_m2", J(1, 2));
  add("center_x_m", center[0]);
  add("center_z_m", center[2]);
  one += "[point.mark]\non = \"a\"\nx_m = 0.3\ny_m = -0.2\nz_m = 0.7\n[start]\ngiven = [\"a\"]\n";
  const auto times = times_to(3, 4);
  const std::vector<std::string> names = {"mark.x", "mark.y", "mark.z", "a.omega_x", "a.omega_y", "a.omega_z"};
  const auto expected = run(Scene::parse(one, "s.toml"), times, names);
  for (const std::string kind : {"rigid_body", "natural_body"}) {
    CAPTURE(kind);
    const auto found = run(Scene::parse(welded(kind), "s.toml"), times, names);
    for (std::size_t i = 0; i < times.size(); ++i)
      for (std::size_t k = 0; k < names.size(); ++k)
        CHECK(found[i][k] == Approx(expected[i][k]).margin(10 * kMotion));
  }
}

TEST_CASE("a free point in space: a conical pendulum turns steadily") {
  // w^2 = g / h on a circle of radius R = 0.6 m, h = 0.8 m below the hook.
  const double R = 0.6, h = 0.8, w = std::sqrt(9.81 / h);
  const Scene scene = Scene::parse(fmt::format(R"(
[gravity]
z_m_per_s2 = -9.81
[point.hook]
ground = true
x_m = 0
y_m = 0
z_m = 0
[point.bob]
x_m = 0.6
y_m = 0
z_m = -0.8
vy_m_per_s = {:.17g}
[mass.bob]
point = "bob"
mass_kg = 1.7
[distance.string]
from = "hook"
to = "bob"
[start]
given = ["bob.x", "bob.y"]
)",
                                               R * w),
                                   "s.toml");
  const auto times = times_to(5, 7);
  for (const char* formulation : {"baumgarte", "index2", "maggi", "penalty"}) {
    CAPTURE(formulation);
    // The penalty gives way by its own reaction over its weight of 1e8 kg: 1e-7 of the length.
    const double margin = formulation == std::string("penalty") ? 1e-5 : 10 * kMotion;
    const auto found = run(scene, times, {"bob.x", "bob.y", "bob.z", "string.tension"}, formulation);
    for (std::size_t i = 0; i < times.size(); ++i) {
      CHECK(found[i][0] == Approx(R * std::cos(w * times[i])).margin(margin));
      CHECK(found[i][1] == Approx(R * std::sin(w * times[i])).margin(margin));
      CHECK(found[i][2] == Approx(-h).margin(margin));
      CHECK(found[i][3] == Approx(1.7 * 9.81 / h).margin(1e-3));  // string of 1 m: m g / cos
    }
  }
}

namespace {

/// The scene of the heavy top with its body in natural coordinates.
std::string read_file(const std::string& path) {
  std::FILE* f = std::fopen(path.c_str(), "rb");
  REQUIRE(f);
  std::string s;
  for (int c; (c = std::fgetc(f)) != EOF;) s += static_cast<char>(c);
  std::fclose(f);
  return s;
}

void replace_all(std::string& s, const std::string& what, const std::string& by) {
  for (std::size_t at = 0; (at = s.find(what, at)) != std::string::npos; at += by.size()) s.replace(at, what.size(), by);
}

}  // namespace

TEST_CASE("the heavy top in natural coordinates has the motion and the gradient of that in Euler parameters") {
  const std::string euler = read_file(std::string(COSTATE_MODELS_DIR) + "/heavy_top/heavy_top.toml");
  std::string natural = euler;
  replace_all(natural, "rigid_body.top", "natural_body.top");
  replace_all(natural, "given = [\"top.e1\", \"top.e2\", \"top.e3\"]", "given = [\"top.orientation\"]");
  const Scene a = Scene::parse(euler, "euler.toml"), b = Scene::parse(natural, "natural.toml");
  REQUIRE(b.mechanism()->coordinate_count() == 12);
  // 150 rad/s over 2 s: 300 rad, whose phase collects the errors of 1e4 steps.
  const double tolerance = 1e-6;
  const std::vector<std::string> names = {"center.x", "center.y", "center.z", "top.omega_x", "top.omega_y", "top.omega_z"};
  const auto times = times_to(1, 4);
  const auto found_a = run(a, times, names), found_b = run(b, times, names);
  for (std::size_t i = 0; i < times.size(); ++i)
    for (std::size_t k = 0; k < names.size(); ++k)
      CHECK(found_b[i][k] == Approx(found_a[i][k]).margin(tolerance * (k < 3 ? 1 : 150)));
  const std::vector<std::string> parameters = {"m", "Iyy", "height", "spin", "precession", "g"};
  Problem pa = problem_of(a, 0.5, "baumgarte", parameters), pb = problem_of(b, 0.5, "baumgarte", parameters);
  const GradientResult ga = gradient(pa, "cvodes-forward", pa.parameters.values());
  CHECK(ga.psi == Approx(gradient(pb, "cvodes-forward", pb.parameters.values()).psi).epsilon(tolerance));
  double size = 0;
  for (std::size_t j = 0; j < parameters.size(); ++j)
    size = std::max(size, std::abs(ga.gradient[j]) * pa.parameters.parameters[j].scale);
  for (const auto& [formulation, method] :
       {std::pair("baumgarte", "cvodes-adjoint"), std::pair("index2", "hand-adjoint"), std::pair("maggi", "hand-adjoint")}) {
    pb.formulation = formulation;
    const GradientResult gb = gradient(pb, method, pb.parameters.values());
    for (std::size_t j = 0; j < parameters.size(); ++j) {
      CAPTURE(formulation, parameters[j], ga.gradient[j], gb.gradient[j]);
      CHECK(std::abs(ga.gradient[j] - gb.gradient[j]) * pa.parameters.parameters[j].scale < tolerance * size);
    }
  }
}
