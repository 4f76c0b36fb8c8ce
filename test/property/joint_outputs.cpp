// What joints and bushings say that they do, in N and N m: balances of a body at rest or at its start, however the axes
// are written; and starts that turn a body away from where the scene has it.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/analysis/start_remarks.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/output.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

using namespace costate;
using Catch::Contains;
using Catch::Detail::Approx;
using Eigen::Vector3d;

namespace {

std::string body_at_origin(const std::string& more) {
  return "[rigid_body.b]\nmass_kg = 1\nx_m = 0\ny_m = 0\nz_m = 0\ninertia_xx_kg_m2 = 0.1\ninertia_yy_kg_m2 = 0.1\n"
         "inertia_zz_kg_m2 = 0.1\n" +
         more +
         "[point.O]\nground = true\nx_m = 0\ny_m = 0\nz_m = 0\n[point.B]\non = \"b\"\nx_m = 0\ny_m = 0\nz_m = 0\n";
}
const std::string kGravity = "[gravity]\nz_m_per_s2 = -9.81\n";

std::vector<double> at_start(const std::string& text, const std::vector<std::string>& outputs) {
  Problem p = make_problem(Scene::parse(text + "[run]\nt_end_s = 1e-3\nformulation = \"index1\"\n", "joint.toml"));
  std::vector<double> values;
  simulate(p, p.parameters.values(), {0.0}, [&](const MechanismState& s, System& system) {
    for (const auto& name : outputs) values.push_back(make_output(*p.mechanism, name)->value(s, system.assembly()));
  });
  return values;
}
std::string written(const Vector3d& a) { return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", a[0], a[1], a[2]); }

}  // namespace

// A rail whose axis was written ten times longer said a tenth of the normal force, and one of length 1 aslant 10.76 N
// of 8.61 N.
TEST_CASE("joint outputs: the force of a rail is that across its axis, however long that is written") {
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0.6, 0.64, 0.48), Vector3d(1, -2, 0.5)})
    for (const double length : {1.0, 10.0, 0.1}) {
      const Vector3d a = length * axis;
      CAPTURE(written(a));
      const std::string text = kGravity + body_at_origin("") +
                               fmt::format(
                                   "[translational.rail]\npoints = [\"O\", \"B\"]\naxis_first = {}\n[start]\n"
                                   "given = [\"b.x\"]\n",
                                   written(a));
      const std::vector<double> f =
          at_start(text, {"lambda.translational.rail.offset_1", "lambda.translational.rail.offset_2", "rail.reaction_x",
                          "rail.reaction_y", "rail.reaction_z"});
      const Vector3d g(0, 0, -9.81);
      const Vector3d across = g - g.dot(axis) / axis.squaredNorm() * axis;
      CHECK(std::hypot(f[0], f[1]) == Approx(across.norm()).epsilon(1e-9));
      CHECK((Vector3d(f[2], f[3], f[4]) - across).norm() < 1e-8);  // on the ground
    }
}

TEST_CASE("joint outputs: the force of a plane is along its normal") {
  for (const char* joint : {"[in_plane.p]\npoints = [\"O\", \"B\"]\nnormal = [0, 3, 4]\n",
                            "[planar.p]\npoints = [\"O\", \"B\"]\nnormal_first = [0, 3, 4]\n"}) {
    CAPTURE(joint);
    const bool turns = std::string(joint).find("in_plane") != std::string::npos;
    const std::vector<double> f =
        at_start(kGravity + body_at_origin("") + joint + "[start]\ngiven = [\"b.x\", \"b.y\", " +
                     (turns ? "\"b.orientation\"]\n" : "\"b.e3\"]\n"),
                 {"p.reaction_x", "p.reaction_y", "p.reaction_z"});
    const Vector3d n(0, 0.6, 0.8), g(0, 0, -9.81);
    CHECK((Vector3d(f[0], f[1], f[2]) - g.dot(n) * n).norm() < 1e-8);  // on the ground
  }
}

// A body of 1 kg half a metre from a hinge along x, level: 4.905 N m about y.
TEST_CASE("joint outputs: the moment of a hinge is in N m, however long its axes are written") {
  const std::string body = kGravity + body_at_origin("center_x_m = 0.5\n");
  for (const auto& [first, second] : {std::pair{1.0, 1.0}, {10.0, 10.0}, {1.0, 10.0}, {0.01, 3.0}}) {
    CAPTURE(first, second);
    const std::string text = body + fmt::format(
                                        "[hinge.h]\npoints = [\"O\", \"B\"]\naxis_first = [{}, 0, 0]\n"
                                        "axis_second = [{}, 0, 0]\n[start]\ngiven = [\"b.e1\"]\n",
                                        first, second);
    const std::vector<double> m =
        at_start(text, {"lambda.hinge.h.tilt_1", "lambda.hinge.h.tilt_2", "h.moment_x", "h.moment_y", "h.moment_z"});
    CHECK(std::hypot(m[0], m[1]) == Approx(4.905).epsilon(1e-9));
    CHECK((Vector3d(m[2], m[3], m[4]) - Vector3d(0, 4.905, 0)).norm() < 1e-8);  // r x m g, on the ground
  }
  for (const double length : {1.0, 5.0}) {
    CAPTURE(length);
    const std::string text =
        body + fmt::format("[fixed.f]\npoints = [\"O\", \"B\"]\naxis_first = [{0}, 0, 0]\naxis_second = [{0}, 0, 0]\n",
                           length);
    const std::vector<double> m = at_start(text, {"lambda.fixed.f.tilt_1", "lambda.fixed.f.tilt_2",
                                                  "lambda.fixed.f.turn", "f.moment_x", "f.moment_y", "f.moment_z"});
    CHECK(Vector3d(m[0], m[1], m[2]).norm() == Approx(4.905).epsilon(1e-9));
    CHECK((Vector3d(m[3], m[4], m[5]) - Vector3d(0, 4.905, 0)).norm() < 1e-8);
  }
}

// A couple holds a body turned on bushings that are stiffer about one axis than another: the moment between ground and
// body is the couple. (6.9, 8.4, 8.9) was said of (8, 6, 10).
TEST_CASE("joint outputs: a bushing's torque is the moment that it transmits") {
  const std::string text =
      body_at_origin("") +
      "[bushing.m]\nfrom = \"O\"\nto = \"B\"\nstiffness_N_per_m = [100, 100, 100]\n"
      "stiffness_N_m_per_rad = [10, 20, 40]\n[couple.c]\nbody = \"b\"\nx_N_m = 8.0\ny_N_m = 6.0\nz_N_m = 10.0\n"
      "[start]\ngiven = []\nequilibrium = true\n";
  const std::vector<double> m =
      at_start(text, {"m.torque_x", "m.torque_y", "m.torque_z", "m.angle_x", "m.angle_y", "m.angle_z"});
  // To the equilibrium's tolerance.
  CHECK((Vector3d(m[0], m[1], m[2]) - Vector3d(8, 6, 10)).norm() < 1e-6);
  CHECK(Vector3d(m[3], m[4], m[5]).norm() > 0.8);  // turned far enough to tell
}

TEST_CASE("joint outputs: a bushing that nothing holds from turning turns round and round") {
  const std::string text = body_at_origin("omega_z_rad_per_s = 20\nvx_m_per_s = 0.5\n") +
                           "[bushing.m]\nfrom = \"O\"\nto = \"B\"\nstiffness_N_per_m = [100, 100, 100]\n[start]\n"
                           "given = [\"b.x\", \"b.y\", \"b.z\", \"b.orientation\"]\n[[cost.terminal]]\nkind = "
                           "\"value\"\noutput = \"b.x\"\n[run]\nt_end_s = 1.0\nrtol = 1e-9\nformulation = \"index1\"\n";
  const Problem p = make_problem(Scene::parse(text, "turns.toml"));
  // 100 N/m and 1 kg: a spring that the turn, six times half a turn, has nothing to do with.
  CHECK(simulate(p, p.parameters.values()).psi == Approx(0.5 / 10 * std::sin(10.0)).epsilon(1e-6));
}

// The axis of the second body is in its own frame: a bar at 1 rad is turned back by a hinge that has the same numbers.
TEST_CASE("joint outputs: a body that the start turns away from its orientation is told of") {
  const auto said = [](const std::string& second) {
    const Scene scene =
        Scene::parse(kGravity + body_at_origin("center_x_m = 0.5\nrotation_axis = [0, 0, 1]\nangle_rad = 1.0\n") +
                         "[hinge.h]\npoints = [\"O\", \"B\"]\naxis_first = [0, 1, 0]\nangle = \"h\"\n" + second +
                         "[start]\ngiven = [\"h.angle\"]\n",
                     "bar.toml");
    Assembly assembly(scene.mechanism(), ParameterSelection{});
    return start_remarks(assembly, find_start(assembly, 0, false));
  };
  const auto turned = said("");
  REQUIRE(turned.size() == 1);
  CHECK_THAT(turned[0], Contains("'b' turned by 57.3 degrees from its first guess") && Contains("second body's frame"));
  // As the first one stands, seen from the second.
  CHECK(said(fmt::format("axis_second = [{:.17g}, {:.17g}, 0]\nnormal_first = [0, 0, 1]\nnormal_second = [0, 0, 1]\n",
                         std::sin(1.0), std::cos(1.0)))
            .empty());
}

// The rows hold with axes opposite as well: a weld half a turn from what the scene says, or an angle that counts the
// other way, of a guess that is nearer to that.
TEST_CASE("joint outputs: axes that the start leaves opposite to each other are told of") {
  const auto said = [](const std::string& joint, const std::string& pose) {
    const Scene scene = Scene::parse(
        kGravity + body_at_origin(pose) + "[" + joint + ".h]\npoints = [\"O\", \"B\"]\naxis_first = [0, 0, 1]\n" +
            (joint == "hinge" ? "angle = \"h\"\nnormal_first = [1, 0, 0]\nnormal_second = [1, 0, 0]\n"
                                "[start]\ngiven = [\"h.angle\"]\n"
                              : "normal_first = [1, 0, 0]\nnormal_second = [1, 0, 0]\n[start]\ngiven = []\n"),
        "s.toml");
    Assembly assembly(scene.mechanism(), ParameterSelection{});
    return start_remarks(assembly, find_start(assembly, 0, false));
  };
  const std::string upright = "rotation_axis = [1, 0.1, 0]\nangle_rad = 0.1\n",
                    flipped = "rotation_axis = [1, 0, 0]\nangle_rad = 3.0\n",
                    turned = "rotation_axis = [0, 0, 1]\nangle_rad = 3.0\n";
  for (const auto& [joint, pose] : {std::pair{"fixed", flipped}, {"fixed", turned}, {"hinge", flipped}}) {
    CAPTURE(joint, pose);
    const auto remarks = said(joint, pose);
    REQUIRE(!remarks.empty());
    CHECK_THAT(remarks.back(), Contains(std::string(joint) + ".h") && Contains("opposite to each other"));
  }
  CHECK(said("fixed", upright).empty());
  CHECK(said("hinge", upright).empty());
  CHECK(said("hinge", turned).empty());  // by its angle
}
