// Inputs that were taken without a word and meant something else than they say.
#include <fmt/format.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <fstream>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/kind/tyre/magic_formula.h"
#include "costate/scene/scene.h"

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

TEST_CASE("silent inputs: data over cycles a second is no function of radians a second") {
  const auto scene = [](const char* unit) {
    return kBody +
           fmt::format(
               "[data.e]\ntimed = false\ncolumns = [\"speed [{}]\", \"torque [N m]\"]\n"
               "rows = [[0, 0], [1, 1], [10, 10]]\n"
               "[couple.c]\nangle = \"b\"\nformula = \"f(b.angle_dot)\"\n"
               "f = {{ kind = \"data\", data = \"e\", column = \"torque\", over = \"speed\", beyond = \"hold\" }}\n",
               unit);
  };
  CHECK_THROWS_WITH(Scene::parse(scene("Hz"), "s.toml"), Contains("s.toml") && Contains("cycles a second"));
  for (const char* unit : {"rpm", "rad/s", "1"}) CHECK_NOTHROW(Scene::parse(scene(unit), "s.toml"));
}

TEST_CASE("silent inputs: a tyre's coefficients that no equation here has are told of") {
  const auto file = "left_out_" + std::to_string(getpid()) + ".tir";
  std::ofstream(file) << "FITTYP = 62\nQSX1 = 0.1\nQSX12 = 0.5\nQSX13 = 0\nQSX14 = 0.2\nUSE_MODE = 124\n";
  MagicFormulaOptions o;
  TyreOptions tyre;
  take_notices();
  read_tir_file(file, o, tyre);
  std::remove(file.c_str());
  const auto said = take_notices();
  REQUIRE(said.size() == 1);
  CHECK_THAT(said.front(), Contains("QSX12, QSX14 have no part"));
}
