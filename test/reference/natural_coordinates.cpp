// Free points and bodies in natural coordinates against closed forms and against the same mechanism in Euler
// parameters.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>

#include "costate/scene/scene_kind.h"
#include "run_scene.h"
#include "support/paths.h"

using namespace costate;
using namespace costate::test;

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
[)" + kind +
         R"(.b]
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
  // Mass 3, centre (1/3, 0, 1/6); tensors about it by Steiner, the second one's turned into the first one's
  // frame.
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.9, Eigen::Vector3d(1, 2, 0.5).normalized()).toRotationMatrix();
  const Eigen::Vector3d center = Eigen::Vector3d(1, 0, 0.5) / 3;
  const auto steiner = [](double m, const Eigen::Vector3d& d) -> Eigen::Matrix3d {
    return m * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  };
  const Eigen::Matrix3d Ja = Eigen::Vector3d(0.2, 0.3, 0.4).asDiagonal(),
                        Jb = Eigen::Vector3d(0.05, 0.1, 0.08).asDiagonal();
  const Eigen::Matrix3d J =
      Ja + steiner(2, -center) + turn * Jb * turn.transpose() + steiner(1, Eigen::Vector3d(1, 0, 0.5) - center);
  std::string one =
      "[rigid_body.a]\nx_m = 0\ny_m = 0\nz_m = 0\nvx_m_per_s = 0.3\nomega_x_rad_per_s = 1\n"
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
      for (std::size_t k = 0; k < names.size(); ++k) CHECK(found[i][k] == Approx(expected[i][k]).margin(10 * kMotion));
  }
}

TEST_CASE("bushings and axis springs: the same motion in either coordinates, and mixed") {
  // The examples of the two kinds, in which one body is in natural coordinates, and all others as they come.
  const auto with = [](std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
      text.replace(at, from.size(), to);
    return text;
  };
  const auto times = times_to(0.6, 3);
  for (const auto& [kind, names] :
       {std::pair(std::string("bushing"),
                  std::vector<std::string>{"lid.x", "foot.y", "seat.z", "rubber.angle_x", "rubber.angle_z",
                                           "rubber.torque_y", "mount.force_z", "stand.angle_y"}),
        std::pair(std::string("axis_spring"),
                  std::vector<std::string>{"hook.x", "ball.y", "seat.z", "rail.force", "rail.rate", "leaf.force"})}) {
    CAPTURE(kind);
    const std::string mixed = find_scene_kind(kind)->example;
    const auto expected = run(Scene::parse(with(mixed, "[natural_body.", "[rigid_body."), "s.toml"), times, names);
    for (const std::string& text : {mixed, with(mixed, "[rigid_body.", "[natural_body.")}) {
      const auto found = run(Scene::parse(text, "s.toml"), times, names);
      for (std::size_t i = 0; i < times.size(); ++i)
        for (std::size_t k = 0; k < names.size(); ++k) {
          CAPTURE(names[k]);
          // Forces of up to 1e3 N/m times the error of the motion.
          const bool force = names[k].find("orce") != std::string::npos || names[k].find("torque") != std::string::npos;
          CHECK(found[i][k] == Approx(expected[i][k]).margin((force ? 1000 : 10) * kMotion));
        }
    }
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
  for (std::size_t at = 0; (at = s.find(what, at)) != std::string::npos; at += by.size())
    s.replace(at, what.size(), by);
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
  const std::vector<std::string> names = {"center.x",    "center.y",    "center.z",
                                          "top.omega_x", "top.omega_y", "top.omega_z"};
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
  for (const auto& [formulation, method] : {std::pair("baumgarte", "cvodes-adjoint"),
                                            std::pair("index2", "hand-adjoint"), std::pair("maggi", "hand-adjoint")}) {
    pb.formulation = formulation;
    const GradientResult gb = gradient(pb, method, pb.parameters.values());
    for (std::size_t j = 0; j < parameters.size(); ++j) {
      CAPTURE(formulation, parameters[j], ga.gradient[j], gb.gradient[j]);
      CHECK(std::abs(ga.gradient[j] - gb.gradient[j]) * pa.parameters.parameters[j].scale < tolerance * size);
    }
  }
}

TEST_CASE("a body that tumbles freely, in natural coordinates, has the reference's rates and attitude") {
  std::string text = read_file(std::string(COSTATE_MODELS_DIR) + "/rigid_body/euler_top.toml");
  replace_all(text, "rigid_body.body", "natural_body.body");
  const Scene scene = Scene::parse(text, "natural.toml");
  const auto reference =
      nlohmann::json::parse(read_file(std::string(COSTATE_MODELS_DIR) + "/rigid_body/reference.json"));
  const std::vector<std::string> rates = {"body.omega_x", "body.omega_y", "body.omega_z"};
  std::vector<std::string> names = rates;
  for (int k = 0; k < 9; ++k) names.push_back(fmt::format("body.u{}{}", k / 3 + 1, "xyz"[k % 3]));
  int count = 0;
  for (const auto& e : reference.at("states")) {
    if (e.at("scene") != "euler_top.toml") continue;
    const auto& values = e.at("values");
    const auto q = [&](const char* key) { return values.at(std::string("body.") + key).get<double>(); };
    const Eigen::Matrix3d A = Eigen::Quaterniond(q("e0"), q("e1"), q("e2"), q("e3")).toRotationMatrix();
    for (const char* formulation : {"baumgarte", "index2", "maggi"}) {
      CAPTURE(formulation, e.at("t_s").get<double>());
      const auto found = run(scene, {e.at("t_s").get<double>()}, names, formulation)[0];
      for (std::size_t i = 0; i < 3; ++i)
        CHECK(found[i] == Approx(values.at(rates[i]).get<double>()).margin(10 * kMotion));
      for (int k = 0; k < 9; ++k)
        CHECK(found[static_cast<std::size_t>(3 + k)] == Approx(A(k % 3, k / 3)).margin(10 * kMotion));
      ++count;
    }
  }
  CHECK(count >= 9);
}

TEST_CASE("natural coordinates: a long, fast spin neither drifts nor goes singular") {
  // 100 rad/s about an oblique axis of a sphere for 60 s, a thousand turns: u(t) turns about that axis.
  const Scene scene = Scene::parse(R"(
[natural_body.ball]
x_m = 0
y_m = 0
z_m = 0
mass_kg = 1
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1
omega_x_rad_per_s = 60
omega_z_rad_per_s = 80
[start]
given = ["ball"]
)",
                                   "s.toml");
  std::vector<std::string> names;
  for (int k = 0; k < 9; ++k) names.push_back(fmt::format("ball.u{}{}", k / 3 + 1, "xyz"[k % 3]));
  const double t = 60;
  const Eigen::Matrix3d expected = Eigen::AngleAxisd(100 * t, Eigen::Vector3d(0.6, 0, 0.8)).toRotationMatrix();
  std::vector<std::unique_ptr<Output>> outputs;
  for (const auto& name : names) outputs.push_back(make_output(*scene.mechanism(), name));
  Problem p = problem_of(scene, t);
  p.solver.integrator = "cvodes";  // Adams' high orders: a quarter of the steps of IDAS, and of their errors
  Eigen::Matrix3d A;
  simulate(p, p.parameters.values(), {t}, [&](const MechanismState& s, System& system) {
    for (int k = 0; k < 9; ++k) A(k % 3, k / 3) = outputs[static_cast<std::size_t>(k)]->value(s, system.assembly());
  });
  // The frame stays a frame; the phase of 6000 rad collects the errors of 1e5 steps, of rtol and of atol 1e-8 each.
  CHECK((A.transpose() * A - Eigen::Matrix3d::Identity()).norm() < kMotion);
  CHECK((A - expected).norm() < 1e5 * 2e-8);
}
