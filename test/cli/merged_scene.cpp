// costate explain --merged: bodies that are welded become one, and move as they did.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <string>

#include "process.h"
#include "support/paths.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

// Three bodies in frames of their own, one of them in natural coordinates, welded to a pendulum; a fourth turns on
// them. Joints whose axes and normals the scene leaves out stand in frames that go.
const std::string kArm = R"toml(title = "Pendulum of three welded parts"

[gravity]
z_m_per_s2 = -9.81

[rigid_body.mast]
x_m = 0
y_m = 0
z_m = 0.5
rotation_axis = [1, 0, 0.2]
angle_rad = 0.3
omega_x_rad_per_s = 1
mass_kg = 2
inertia_xx_kg_m2 = 0.2
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.3
center_y_m = 0.1

[rigid_body.spar]
x_m = 0.2
y_m = 0
z_m = 1
rotation_axis = [0, 1, 0.3]
angle_rad = 1.1
mass_kg = 1
inertia_xx_kg_m2 = 0.05
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1

[natural_body.flag]
x_m = 1
y_m = 0
z_m = 1
mass_kg = 0.2
inertia_xx_kg_m2 = 0.01
inertia_yy_kg_m2 = 0.01
inertia_zz_kg_m2 = 0.01

[rigid_body.vane]
x_m = 1
y_m = 0.5
z_m = 1.1
mass_kg = 0.3
inertia_xx_kg_m2 = 0.01
inertia_yy_kg_m2 = 0.02
inertia_zz_kg_m2 = 0.015

[point.A]
ground = true
x_m = 0
y_m = 0
z_m = 0

[point.foot]
on = "mast"
x_m = 0
y_m = 0
z_m = -0.5

[point.top]
on = "mast"
x_m = 0
y_m = 0
z_m = 0.5

[point.root]
on = "spar"
x_m = 0.1
y_m = 0
z_m = -0.2

[point.end]
on = "spar"
x_m = -0.3
y_m = 0
z_m = 0.9

[point.hem]
on = "flag"
x_m = 0
y_m = 0.1
z_m = 0

[point.tip]
on = "flag"
x_m = 0.1
y_m = 0.2
z_m = 0

[point.pin]
on = "vane"
x_m = 0
y_m = 0
z_m = -0.1

[spherical.foot]
points = ["A", "foot"]

[fixed.weld]
points = ["top", "root"]

[fixed.seam]
points = ["end", "hem"]
axis_first = [0, 1, 0]
axis_second = [1, 0, 0]
normal_first = [1, 0, 0.2]
normal_second = [0, 1, 0]

[hinge.vane]
points = ["tip", "pin"]
axis_first = [0, 0, 1]
angle = "vane"

[start]
given = ["mast.e1", "mast.e2", "mast.e3", "vane.angle"]
given_velocities = ["mast.omega_x", "mast.omega_y", "mast.omega_z", "vane.angle"]

[[cost.running]]
kind = "square"
output = "flag.x"

[[cost.terminal]]
kind = "square"
output = "vane.angle_dot"

[run]
t_end_s = 1
parameters = ["rigid_body.spar.mass_kg", "rigid_body.mast.center_y_m"]
)toml";

std::string with(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

/// The scene of kArm without its parameters.
std::string plain(const std::string& text) {
  return with(text, "parameters = [\"rigid_body.spar.mass_kg\", \"rigid_body.mast.center_y_m\"]\n", "");
}

Json merged(const WorkingDirectory& here, const std::string& scene) {
  write_text(here / "arm.toml", scene);
  return costate_json({"explain", "arm.toml", "--no-files", "--merged", "one.toml"}, here.path()).at("merged_scene");
}

std::string refusal(const WorkingDirectory& here, const std::string& scene) {
  write_text(here / "arm.toml", scene);
  const auto r = run_costate({"explain", "arm.toml", "--no-files", "--merged", "not.toml"}, here.path());
  CHECK(r.status == 1);
  CHECK(!std::filesystem::exists(here / "not.toml"));
  return r.err;
}

}  // namespace

TEST_CASE("explain --merged: psi and gradients are those of the welded bodies") {
  const WorkingDirectory here;
  const Json j = merged(here, kArm);
  CHECK(j.at("bodies") == Json({"natural_body.flag", "rigid_body.spar"}));
  // Of 7 + 7 + 12 + 7 coordinates and an angle: mast, vane and angle; of 30 rows the ball joint, two norms, the hinge.
  CHECK(j.at("coordinates") == 15);
  CHECK(j.at("multipliers") == 11);
  // The other scene's formulation is the oracle: welds by constraint rows, bodies with masses of their own. Both runs
  // have rtol 1e-10, gradients some 1e3 times that.
  const auto gradient = [&](const char* scene) {
    return costate_json({"gradient", scene, "--no-files", "--rtol", "1e-10"}, here.path());
  };
  const Json two = gradient("arm.toml"), one = gradient("one.toml");
  CHECK(one.at("psi").get<double>() == Approx(two.at("psi").get<double>()).epsilon(1e-7));
  CHECK(one.at("gradient").at("mass.spar.mass_kg").get<double>() ==
        Approx(two.at("gradient").at("rigid_body.spar.mass_kg").get<double>()).epsilon(1e-6));
  CHECK(one.at("gradient").at("rigid_body.mast.center_y_m").get<double>() ==
        Approx(two.at("gradient").at("rigid_body.mast.center_y_m").get<double>()).epsilon(1e-6));
}

TEST_CASE("explain --merged: masses, centres and inertias become one body's where nothing varies them") {
  const WorkingDirectory here;
  const std::string scene = plain(kArm);
  const double psi = merged(here, scene).at("psi");
  const Json two = costate_json({"simulate", "arm.toml", "--no-files"}, here.path());
  CHECK(psi == Approx(two.at("psi").get<double>()).epsilon(1e-6));
  // One mass, and energies of the same motion: 2 + 1 + 0.2 kg.
  const auto dump = run_costate({"dump", "one.toml"}, here.path());
  CHECK_THAT(dump.out, Contains("mass_kg = 3.2") && !Contains("[mass.") && !Contains("[fixed."));
}

TEST_CASE("explain --merged: what is welded to the ground stands there") {
  const WorkingDirectory here;
  std::string scene = plain(kArm);
  scene = with(scene, "[spherical.foot]", "[fixed.foot]");
  scene = with(scene, "given = [\"mast.e1\", \"mast.e2\", \"mast.e3\", \"vane.angle\"]", "given = [\"vane.angle\"]");
  scene = with(scene, "given_velocities = [\"mast.omega_x\", \"mast.omega_y\", \"mast.omega_z\", \"vane.angle\"]",
               "given_velocities = [\"vane.angle\"]");
  scene = with(scene, "[[cost.running]]\nkind = \"square\"\noutput = \"flag.x\"\n", "");
  scene = with(scene, "angle = \"vane\"", "angle = \"vane\"\nangular_velocity_rad_per_s = 3");
  const Json j = merged(here, scene);
  CHECK(j.at("coordinates") == 8);
  CHECK(j.at("multipliers") == 7);
  const double psi = costate_json({"simulate", "arm.toml", "--no-files"}, here.path()).at("psi");
  CHECK(j.at("psi").get<double>() == Approx(psi).epsilon(1e-6));
  CHECK(psi > 1);
}

TEST_CASE("explain --merged: a weld whose reaction is asked for stays") {
  const WorkingDirectory here;
  const Json j = merged(here, with(plain(kArm), "output = \"flag.x\"", "output = \"weld.moment_x\""));
  CHECK(j.at("bodies") == Json({"natural_body.flag"}));
  CHECK(j.at("kept").size() == 1);
  CHECK_THAT(j.at("kept").at(0).get<std::string>(), Contains("fixed.weld stays"));
  CHECK(
      j.at("psi").get<double>() ==
      Approx(costate_json({"simulate", "arm.toml", "--no-files"}, here.path()).at("psi").get<double>()).epsilon(1e-5));
}

TEST_CASE("explain --merged: guesses that do not fit together start the same") {
  const WorkingDirectory here;
  // The spar's guess is off by decimetres, and the distance between points of two bodies is taken from the guesses.
  std::string scene = with(plain(kArm), "[start]",
                           "[point.hook]\nground = true\nx_m = 0\ny_m = 1\nz_m = 0\n[spring.cord]\nfrom = "
                           "\"hook\"\nto = \"pin\"\nstiffness_N_per_m = 20\nnatural_length_m = 0.3\n[start]");
  const Json j = merged(here, scene);
  CHECK(
      j.at("psi").get<double>() ==
      Approx(costate_json({"simulate", "arm.toml", "--no-files"}, here.path()).at("psi").get<double>()).epsilon(1e-6));
}

TEST_CASE("explain --merged: a bushing's frame turns with the body that it is on") {
  const WorkingDirectory here;
  for (const char* own : {"", "rotation_axis_from = [1, 0, 2]\nangle_from_rad = 0.7\n"}) {
    CAPTURE(own);
    const Json j = merged(
        here, with(plain(kArm), "[start]",
                   std::string("[bushing.mount]\nfrom = \"end\"\nto = \"pin\"\n") + own +
                       "stiffness_N_per_m = [2, 30, 9]\nstiffness_N_m_per_rad = [1, 0.2, 3]\ndamping_N_s_per_m = "
                       "[0.1, 0.3, 0.02]\npreload_N_m = [0.1, 0.2, -0.3]\n[start]"));
    const double psi = costate_json({"simulate", "arm.toml", "--no-files"}, here.path()).at("psi");
    CHECK(j.at("psi").get<double>() == Approx(psi).epsilon(1e-5));
    CHECK_THAT(run_costate({"dump", "one.toml"}, here.path()).out, Contains("rotation_axis_from"));
  }
}

TEST_CASE("explain --merged: what a frame that goes is needed for is refused by name") {
  const WorkingDirectory here;
  CHECK_THAT(refusal(here, with(kArm, "rigid_body.mast.center_y_m", "point.tip.x_m")), Contains("'point.tip.x_m'"));
  CHECK_THAT(refusal(here, with(kArm, "rigid_body.spar.mass_kg", "rigid_body.spar.inertia_xx_kg_m2")),
             Contains("'rigid_body.spar.inertia_xx_kg_m2'") && Contains("welded to 'mast'"));
  CHECK_THAT(refusal(here, with(kArm, "rigid_body.mast.center_y_m", "rigid_body.mast.inertia_xx_kg_m2")),
             Contains("varies an inertia of 'mast'"));
  CHECK_THAT(refusal(here, with(kArm, "output = \"flag.x\"", "output = \"flag.omega_x\"")), Contains("'flag.omega_x'"));
  CHECK_THAT(refusal(here, with(kArm, "[start]",
                                "[force.jet]\npoint = \"end\"\nframe = \"body\"\nx_N = 1\ny_N = 0\nz_N = 0\n[start]")),
             Contains("[force.jet]"));
  const auto r = run_costate(
      {"explain", COSTATE_MODELS_DIR "/heavy_top/heavy_top.toml", "--no-files", "--merged", "not.toml"}, here.path());
  CHECK(r.status == 1);
  CHECK_THAT(r.err, Contains("No bodies are welded"));
}
