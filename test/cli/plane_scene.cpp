// Scenes in space that move in a plane: the five-bar written so, the scene of the plane that explain --plane writes of
// one, and what that refuses. Welds that explain names.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "five_bar.h"
#include "process.h"
#include "support/paths.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::kGradient;
using costate::test::kPsi;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

const std::string kInSpace = COSTATE_MODELS_DIR "/five_bar/five_bar_in_space.toml";

void check_five_bar(const Json& j) {
  // index1 at rtol = 1e-8, whose drift over 5 s leaves some 4e-7 of psi.
  CHECK(j.at("psi").get<double>() == Approx(kPsi).epsilon(2e-6));
  for (const char* name : {"L01", "L02", "k1", "k2"}) {
    CAPTURE(name);
    CHECK(j.at("gradient").at(name).get<double>() == Approx(kGradient.at(name)).epsilon(1e-5));
  }
}

// A body that swings about an axis along y through a point of the ground, held by a spring to another.
std::string swing(const std::string& more = "") {
  return R"(
[gravity]
x_m_per_s2 = 1
z_m_per_s2 = -9.81

[point.pivot]
ground = true
x_m = 0.1
y_m = 0.3
z_m = 0.2

[point.hook]
ground = true
x_m = 1
y_m = 0.3
z_m = 1

[natural_body.arm]
x_m = 0.1
y_m = 0.3
z_m = 0.2
rotation_axis = [1, 0, 0]
angle_rad = 1.5707963267948966
omega_z_rad_per_s = 0.8
mass_kg = 2
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.2
inertia_zz_kg_m2 = 0.25
center_x_m = 0.4
center_y_m = 0.1

[point.base]
on = "arm"
x_m = 0
y_m = 0
z_m = 0

[point.tip]
on = "arm"
x_m = 0.8
y_m = -0.1
z_m = 0

[hinge.pin]
points = ["pivot", "base"]
axis_first = [0, 1, 0]
axis_second = [0, 0, -1]

[spring.hold]
from = "hook"
to = "tip"
stiffness_N_per_m = 30
natural_length_m = 0.4

[start]
given = ["arm.u1z"]

[[cost.running]]
kind = "square"
output = "tip.z"
target = 0.5

[[cost.terminal]]
kind = "square"
output = "tip.x_dot"

[parameter.mass]
number = "natural_body.arm.mass_kg"

[parameter.inertia]
number = "natural_body.arm.inertia_zz_kg_m2"

[parameter.center]
number = "natural_body.arm.center_y_m"

[parameter.tip]
number = "point.tip.y_m"

[parameter.gravity]
number = "gravity.z_m_per_s2"

[parameter.stiffness]
number = "spring.hold.stiffness_N_per_m"

)" + more +
         R"(
[run]
t_end_s = 1
rtol = 1e-8
parameters = ["mass", "inertia", "center", "tip", "gravity", "stiffness"]
)";
}

}  // namespace

TEST_CASE("plane: the five-bar written in space has the plane's psi and gradient") {
  const WorkingDirectory here;
  const Json j = costate_json({"gradient", kInSpace, "--no-files", "--parameters", "L01,L02,k1,k2"}, here.path());
  check_five_bar(j);
  CHECK(j.at("warnings").empty());  // no redundant rows
}

TEST_CASE("plane: explain writes the five-bar's scene of the plane") {
  const WorkingDirectory here;
  const Json j = costate_json({"explain", kInSpace, "--no-files", "--plane", "flat.toml"}, here.path());
  CHECK(j.at("coordinates") == 4 * 7);
  CHECK(j.at("plane_scene").at("psi").get<double>() == Approx(kPsi).epsilon(2e-6));
  const Json flat = costate_json({"explain", "flat.toml", "--no-files"}, here.path());
  CHECK(flat.at("coordinates") == 4 * 3);
  CHECK(flat.at("plane").is_null());
  CHECK(flat.at("degrees_of_freedom") == 2);
  check_five_bar(costate_json({"gradient", "flat.toml", "--no-files", "--parameters", "L01,L02,k1,k2"}, here.path()));
}

TEST_CASE("plane: a scene across y, of a body whose frame lies against the plane, keeps psi and gradient") {
  const WorkingDirectory here;
  write_text(here / "swing.toml", swing());
  const Json written = costate_json({"explain", "swing.toml", "--no-files", "--plane", "flat.toml"}, here.path());
  for (const Json& warning : written.at("warnings"))
    CHECK_THAT(warning.get<std::string>(), !Contains("they are not the same"));
  const Json space = costate_json({"gradient", "swing.toml", "--no-files"}, here.path()),
             flat = costate_json({"gradient", "flat.toml", "--no-files"}, here.path());
  // Two runs at rtol = 1e-8, each right to some hundred times that.
  const double psi = space.at("psi").get<double>();
  CHECK(flat.at("psi").get<double>() == Approx(psi).epsilon(2e-6));
  for (const auto& [name, value] : space.at("gradient").items()) {
    CAPTURE(name);
    CHECK(flat.at("gradient").at(name).get<double>() == Approx(value.get<double>()).epsilon(2e-5).margin(1e-6 * psi));
  }
}

TEST_CASE("plane: what the plane has no like of is refused by name, and nothing is written") {
  const WorkingDirectory here;
  const auto refused = [&](const std::string& more) {
    write_text(here / "swing.toml", swing(more));
    const auto o = run_costate({"explain", "swing.toml", "--no-files", "--plane", "flat.toml"}, here.path());
    CHECK(o.status == 1);
    CHECK_FALSE(std::filesystem::exists(here / "flat.toml"));
    return o.err;
  };
  CHECK_THAT(refused("[maxwell.soft]\nfrom = \"hook\"\nto = \"tip\"\nstiffness_N_per_m = 1\nnatural_length_m = "
                     "0.4\ndamping_N_s_per_m = 1\n"),
             Contains("[maxwell.soft]"));
  CHECK_THAT(refused("[parameter.other]\nnumber = \"natural_body.arm.inertia_xx_kg_m2\"\n"), Contains("'other'"));
  CHECK_THAT(refused("[output.height]\nformula = \"tip.z\"\nunit = \"m\"\n"), Contains("[output.height]"));
  // Of the plane already, or of space.
  const auto five_bar =
      run_costate({"explain", costate::test::kFiveBar, "--no-files", "--plane", "flat.toml"}, here.path());
  CHECK(five_bar.status == 1);
  CHECK_THAT(five_bar.err, Contains("--plane"));
}

TEST_CASE("explain: welds with what one body would save") {
  const WorkingDirectory here;
  const std::string box = "mass_kg = 1\ninertia_xx_kg_m2 = 0.1\ninertia_yy_kg_m2 = 0.1\ninertia_zz_kg_m2 = 0.1\n";
  write_text(here / "weld.toml",
             "[gravity]\nz_m_per_s2 = -9.81\n\n[rigid_body.a]\nx_m = 0\ny_m = 0\nz_m = 0\n" + box +
                 "\n[natural_body.b]\nx_m = 1\ny_m = 0\nz_m = 0\n" + box +
                 "\n[point.A]\non = \"a\"\nx_m = 0.5\ny_m = 0\nz_m = 0\n\n[point.B]\non = \"b\"\nx_m = "
                 "-0.5\ny_m = 0\nz_m = 0\n\n[fixed.weld]\npoints = [\"A\", \"B\"]\n\n[start]\ngiven = "
                 "[\"a\"]\n\n[run]\nt_end_s = 0.2\n");
  const Json j = costate_json({"explain", "weld.toml", "--no-files"}, here.path()).at("welds");
  REQUIRE(j.size() == 1);
  CHECK(j.at(0).at("weld") == "fixed.weld");
  CHECK(j.at(0).at("bodies") == Json({"rigid_body.a", "natural_body.b"}));
  // Six rows of the weld and six that keep b's base vectors of length one and square to each other.
  CHECK(j.at(0).at("rows") == 6 + 6);
  CHECK(j.at(0).at("coordinates") == 12);
}
