// Inputs that were taken without a word and meant something else than they say.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/scene/scene.h"
#include "support/paths.h"

using namespace costate;
using Catch::Contains;

namespace {
const std::string kBody =
    "[body.b]\nmass_kg = 1\ninertia_kg_m2 = 1\nx_m = 0\ny_m = 0\nangular_velocity_rad_per_s = 6.283185307179586\n"
    "[run]\nt_end_s = 2\n";
std::string measured(const std::string& unit, const std::string& of) {
  return kBody + fmt::format(
                     "[data.d]\ncolumns = [\"t [s]\", \"f [{}]\"]\nrows = [[0, 1], [1, 1]]\n"
                     "[output.rate]\nformula = \"b.angle_dot\"\nunit = \"1/s\"\n"
                     "[[cost.samples]]\ndata = \"d\"\ncolumn = \"f\"\noutput = \"{}\"\nsigma = 1\n",
                     unit, of);
}
}  // namespace

TEST_CASE("silent inputs: turns a second are no radians a second") {
  CHECK_THROWS_WITH(Scene::parse(measured("Hz", "b.angle_dot"), "s.toml"),
                    Contains("s.toml") && Contains("rad/s or rpm"));
  CHECK_THROWS_WITH(Scene::parse(measured("1/min", "rate"), "s.toml"), Contains("in Hz"));
  CHECK_NOTHROW(Scene::parse(measured("rpm", "b.angle_dot"), "s.toml"));
  CHECK_NOTHROW(Scene::parse(measured("rad/s", "rate"), "s.toml"));
  CHECK_NOTHROW(Scene::parse(measured("Hz", "rate"), "s.toml"));
}

TEST_CASE("silent inputs: a number twice in one parameter, steps that do not rise") {
  CHECK_THROWS_WITH(
      Scene::parse(kBody + "[parameter.a]\nnumbers = [\"body.b.mass_kg\", \"body.b.mass_kg\"]\n", "s.toml"),
      Contains("s.toml") && Contains("'body.b.mass_kg' is listed twice"));
  CHECK_THROWS_WITH(Scene::parse(kBody + "[couple.c]\nangle = \"b.angle\"\ntorque_N_m = { kind = \"steps\", at = "
                                         "[0.5, 0.4], values = [0, 1, 3], width = 0.1 }\n",
                                 "s.toml"),
                    Contains("'at' must increase"));
}

TEST_CASE("silent inputs: a hinge's angle, as a parameter far from the first poses") {
  const Scene scene = Scene::parse(R"(
point = { O = { ground = true, x_m = 0, y_m = 0, z_m = 0 }, AO = { on = "A", x_m = 0, y_m = 0, z_m = 0 }, tip = { on = "A", x_m = 1, y_m = 0, z_m = 0 } }
[rigid_body.A]
mass_kg = 2
inertia_xx_kg_m2 = 0.05
inertia_yy_kg_m2 = 0.08
inertia_zz_kg_m2 = 0.06
x_m = 0
y_m = 0
z_m = 0
rotation_axis = [0, 1, 0]
angle_rad = 0.1
[hinge.h]
points = ["O", "AO"]
axis_first = [0, 1, 0]
normal_first = [1, 0, 0]
normal_second = [1, 0, 0]
angle = "h"
angle_rad = 1
[start]
given = ["h"]
)",
                                   "s.toml");
  const auto selection = scene.mechanism()->select({"hinge.h.angle_rad"});
  Assembly assembly(scene.mechanism(), selection);
  for (const double angle : {1.0, 1.7, 2.9, 4.0, -2.5}) {
    INFO(angle);
    assembly.set_parameters(&angle);
    const Start start = find_start(assembly, 0, false);
    // e0 and e2 are those of half the angle about y, up to their common sign.
    const double e0 = start.q[3], e2 = start.q[5];
    CHECK(1 - 2 * e2 * e2 == Approx(std::cos(angle)).margin(1e-12));
    CHECK(2 * e0 * e2 == Approx(std::sin(angle)).margin(1e-12));
  }
}
